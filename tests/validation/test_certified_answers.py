"""PIC against certified runs that are committed as data: needs no python-flint.

The data is made by ``python -m benchmarks.certified_answers``; each number in it is within its radius of the truth.
"""

import json
from pathlib import Path

import numpy as np
from tests.cases import each
from tests.validation.certified_files import from_enclosures

from carom import CertifiedTrace, solve_pic
from carom.comparator import compute_horizon
from carom.solvers.certified.result import Ending
from carom.solvers.certified.serialisation import enclosures

FILES = sorted((Path(__file__).parent / "certified").glob("*.json"))

#: Float64 errors double every few impacts in the densest of these scenes, whatever the formula: of its 60 impacts the
#: later half is beyond what float64 holds to twelve digits.
LAST_OF_TWELVE_DIGITS = 30


def load(path: Path) -> CertifiedTrace:
    return from_enclosures(json.loads(path.read_text()))


@each("path", FILES)
def test_pic_is_within_twelve_digits_of_what_is_proven(path: Path) -> None:
    """Same bodies in the same order, and times and velocities to 1e-12, for every impact up to the thirtieth."""
    certified = load(path)
    count = min(len(certified), LAST_OF_TWELVE_DIGITS)
    limit = None if certified.ending is Ending.COMPLETED else len(certified)
    found = compute_horizon(certified, solve_pic(certified.trace.scene, max_impacts=limit), tolerance=1e-12)
    assert found.agreed >= count
    assert found.order_differs is None or found.order_differs >= len(certified)


@each("path", FILES)
def test_every_number_of_the_data_is_proven_to_fifteen_digits(path: Path) -> None:
    """Radii are finite, not negative, and no more than what fifteen digits and float64's rounding allow."""
    certified = load(path)
    speed = max(np.hypot(*disc.velocity_m_s) for disc in certified.trace.scene.discs)
    time, radius = certified.trace.impacts["time_s"], certified.radii["time_s"]
    assert np.all((radius >= 0) & (radius <= 1.2e-15 * time))
    for name in ("velocity_first_after", "velocity_second_after"):
        within = np.abs(certified.trace.impacts[name]) * 2.0**-52 + 1e-15 * speed
        assert np.all((certified.radii[name] >= 0) & (certified.radii[name] <= within))


@each("path", FILES)
def test_the_data_is_read_as_it_was_written(path: Path) -> None:
    """Writing what was read gives the same document: nothing is lost on the way."""
    document = json.loads(path.read_text())
    assert enclosures(from_enclosures(document)) == document


def test_a_degenerate_scene_is_among_the_data() -> None:
    """What has no certain answer is data, too: the event is named."""
    named = [load(path).degeneracy for path in FILES if load(path).ending is Ending.DEGENERATE]
    assert named
    assert all(degeneracy is not None and degeneracy.proven for degeneracy in named)
