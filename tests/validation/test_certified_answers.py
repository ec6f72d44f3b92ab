"""PIC against certified runs that are committed as data: needs no python-flint.

The data is made by ``python -m benchmarks.certified_answers``; each number in it is within its radius of the truth.
"""

import json
from pathlib import Path

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


def load_certified_run(path: Path) -> CertifiedTrace:
    return from_enclosures(json.loads(path.read_text()))


@each("path", FILES)
def test_pic_matches_stored_certified_runs_to_twelve_digits(path: Path) -> None:
    """PIC has the bodies, order, times and velocities of each stored certified run, to 1e-12, up to impact 30."""
    certified = load_certified_run(path)
    count = min(len(certified), LAST_OF_TWELVE_DIGITS)
    limit = None if certified.ending is Ending.COMPLETED else len(certified)
    found = compute_horizon(certified, solve_pic(certified.trace.scene, max_impacts=limit), tolerance=1e-12)
    assert found.agreed >= count
    assert found.order_differs is None or found.order_differs >= len(certified)


@each("path", FILES)
def test_stored_certified_runs_survive_a_round_trip(path: Path) -> None:
    """Reading a stored certified run and writing it again gives the same document."""
    document = json.loads(path.read_text())
    assert enclosures(from_enclosures(document)) == document
