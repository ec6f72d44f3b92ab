"""Releases of engines, bare and by `carom history`: downloaded from the registries, or read from the cache."""

import json
import math
import statistics
import subprocess
import sys
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from docs.figures.history import SCENES
from numpy.typing import NDArray
from tests.cases import each

from carom import Scene, solve_pic
from carom.catalogue import all_scenes, find_scenes
from carom.comparator.shifted_scenes import shift_start
from carom.studies.history.compare_cells import ChangeKind
from carom.studies.history.options import HistoryOptions
from carom.studies.history.registry_clients import CLIENTS, ClientError
from carom.studies.history.release_cache import ReleaseCache, open_release_cache
from carom.studies.history.run import run_history

pytestmark = [pytest.mark.engines, pytest.mark.release]

HERE = Path(__file__).parent
PHASES = 32
#: The registry and the package of each engine.
PACKAGES = {
    "matter": ("npm", "matter-js"),
    "planck": ("npm", "planck"),
    "rapier": ("npm", "@dimforge/rapier2d-compat"),
    "pymunk": ("pip", "pymunk"),
    "mujoco": ("pip", "mujoco"),
    "dart": ("pip", "dartpy"),
    "newton": ("pip", "newton"),
}

#: What a bare run gives at one phase: states at the end, turns of velocities, and in matter.js contacts that begin.
Run = dict[str, Any]


@pytest.fixture(scope="module")
def release_cache() -> Iterator[ReleaseCache]:
    """The cache of `carom history`."""
    with open_release_cache(4e9) as found:
        yield found


def run_program(release_cache: ReleaseCache, engine: str, version: str, program: str, *arguments: str) -> Any:
    """Install a release, run a program of this folder with it, and return what it prints as JSON."""
    registry, package = PACKAGES[engine]
    try:
        folder = release_cache.install(CLIENTS[registry], registry, package, version)
    except ClientError as error:
        pytest.skip(str(error))
    command = [sys.executable if program.endswith(".py") else "node", str(HERE / program), str(folder), *arguments]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    return json.loads(done.stdout.splitlines()[-1])  # pymunk 5 prints a line of its own


def run_bare(
    release_cache: ReleaseCache, engine: str, version: str, folder: Path, names: Sequence[str]
) -> dict[str, list[Run]]:
    """Return what a release gives at each phase of some scenes, as shipped and without Carom."""
    scenes = folder / "scenes.json"
    scenes.write_text(json.dumps([entry.scene.model_dump(mode="json") for entry in find_scenes(names)]))
    program = "bare_releases.py" if PACKAGES[engine][0] == "pip" else "bare_releases.mjs"
    found: dict[str, list[Run]] = run_program(release_cache, engine, version, program, engine, str(scenes))
    return found


def compute_end_errors(scene: Scene, runs: Sequence[Run]) -> NDArray[np.float64]:
    """Return the errors of places and velocities at the end, a step after the scene's, at each phase."""
    dt_s = 1 / scene.frame_rate_hz
    until = {"duration_s": (round(scene.duration_s / dt_s) + 1) * dt_s}
    exact = [solve_pic(shift_start(scene, k / PHASES * dt_s).model_copy(update=until)) for k in range(PHASES)]
    ends = [np.hstack([trace.final_position_m, trace.final_velocity_m_s]) for trace in exact]
    return np.array([run["end"] for run in runs]) - np.array(ends)


def velocity(scene: Scene, runs: Sequence[Run]) -> list[float]:
    """Return the largest velocity error at each phase, over the greatest speed of the scene."""
    fastest = max(math.hypot(*disc.velocity_m_s) for disc in scene.discs)
    errors = np.linalg.norm(compute_end_errors(scene, runs)[:, :, 2:], axis=2).max(axis=1)
    return [float(error) / fastest for error in errors]


def place(scene: Scene, runs: Sequence[Run]) -> list[float]:
    """Return the largest place error at each phase, in metres."""
    errors = np.linalg.norm(compute_end_errors(scene, runs)[:, :, :2], axis=2).max(axis=1)
    return [float(error) for error in errors]


def height(scene: Scene, runs: Sequence[Run]) -> list[float]:
    """Return by how much the first disc ends too high at each phase, in metres."""
    return [float(error) for error in compute_end_errors(scene, runs)[:, 0, 1]]


def gap(_scene: Scene, runs: Sequence[Run]) -> list[float]:
    """Return the gap of two discs of radius 0.25 m along x at the end of each phase, in metres."""
    return [run["end"][1][0] - run["end"][0][0] - 0.5 for run in runs]


def turns(_scene: Scene, runs: Sequence[Run]) -> list[float]:
    """Return in how many steps velocities turn at each phase."""
    return [run["turns"] for run in runs]


def met(_scene: Scene, runs: Sequence[Run]) -> list[float]:
    """Return how often two discs begin to touch at each phase."""
    return [run["met"] for run in runs]


def energy(scene: Scene, runs: Sequence[Run]) -> list[float]:
    """Return the kinetic energy at the end of each phase, over that at the start."""
    mass, start = scene.arrays.mass_kg, scene.arrays.velocity_m_s
    ends = np.array([run["end"] for run in runs])[:, :, 2:]
    left = (mass * (ends**2).sum(axis=2)).sum(axis=1) / float((mass * (start**2).sum(axis=1)).sum())
    return [float(value) for value in left]


def parting(_scene: Scene, runs: Sequence[Run]) -> list[float]:
    """Return the speed at which two discs separate at each phase, in m/s."""
    return [run["end"][1][2] - run["end"][0][2] for run in runs]


Measure = Callable[[Scene, Sequence[Run]], list[float]]
#: By engine, release and scene: what is measured, and its least and most of 32 phases. See docs/results/history.md.
MEASURED: dict[tuple[str, str], list[tuple[str, Measure, float, float]]] = {
    ("matter", "0.12.0"): [
        ("classics/sorting", velocity, 0.2056, 0.2056),
        ("classics/cradle-gaps", velocity, 0.09371, 0.09371),
        ("classics/oblique-3-4-5", velocity, 0.08188, 0.08296),
        ("paper/late", velocity, 0.01214, 0.01226),
        ("classics/restitution-ladder", velocity, 0.03755, 0.03755),
        ("classics/restitution-ladder", turns, 6, 6),
        ("classics/box", place, 0.5980, 0.7985),
        ("classics/perfectly-inelastic", met, 1, 1),
        ("classics/perfectly-inelastic", gap, -0.004031, 0.1254),
    ],
    ("matter", "0.14.0"): [
        ("classics/sorting", velocity, 0.1091, 0.1091),
        ("classics/cradle-gaps", velocity, 0.07441, 0.07441),
        ("classics/oblique-3-4-5", velocity, 0.08304, 0.08657),
        ("paper/late", velocity, 0.01942, 0.02149),
        ("classics/restitution-ladder", velocity, 0.3076, 0.3076),
        ("classics/restitution-ladder", turns, 7, 7),
        ("classics/box", place, 1.109, 1.500),
        ("classics/perfectly-inelastic", met, 1, 1),
        ("classics/perfectly-inelastic", gap, -0.004031, -0.004031),
    ],
    ("matter", "0.19.0"): [("classics/sorting", velocity, 0.2380, 0.2380)],
    ("rapier", "0.19.3"): [
        ("classics/cradle-gaps", velocity, 0.0, 0.1125),
        ("classics/perfectly-inelastic", place, 5.021e-4, 5.028e-4),
    ],
    ("rapier", "0.20.0"): [
        ("classics/cradle-gaps", velocity, 0.0, 0.0),
        ("classics/perfectly-inelastic", place, 2.6e-6, 2.7e-5),
    ],
    ("dart", "6.16.2"): [
        ("classics/box", turns, 0, 0),
        ("classics/restitution-ladder", turns, 1, 1),
        ("classics/bank-shot", turns, 1, 2),
    ],
    ("dart", "6.19.5"): [
        ("classics/sorting", velocity, 0.08584, 1.177),
        ("classics/cradle-gaps", velocity, 0.1951, 0.3753),
        ("classics/head-on", velocity, 9.419e-7, 7.292e-6),
        ("classics/box", turns, 22, 30),
        ("classics/restitution-ladder", turns, 8, 10),
        ("paper/wrong-direction", height, -1.463, -0.03755),
    ],
    ("dart", "6.20.0"): [
        ("classics/sorting", velocity, 4.56e-5, 4.56e-5),
        ("classics/cradle-gaps", velocity, 4.0e-5, 4.0e-5),
        ("classics/head-on", velocity, 1.6e-5, 1.687e-5),
        ("classics/box", turns, 13, 13),
        ("classics/restitution-ladder", turns, 8, 8),
        ("classics/bank-shot", turns, 3, 3),
        ("paper/wrong-direction", height, 0.01733, 1.249),
    ],
    ("newton", "1.5.2"): [
        ("classics/one-into-two", energy, 1.745, 1.910),
        ("classics/cradle-touching", energy, 0.3400, 0.5813),
        ("issues/newton-4103", parting, 0.07777, 0.1522),
    ],
    ("newton", "1.6.1"): [
        ("classics/one-into-two", energy, 1.949, 1.970),
        ("classics/cradle-touching", energy, 0.4557, 0.8019),
        ("issues/newton-4103", parting, 0.0, 0.0),
    ],
}


@each("engine, version", MEASURED)
def test_bare_releases_have_the_documented_errors(
    engine: str, version: str, release_cache: ReleaseCache, tmp_path: Path
) -> None:
    """Measured over 32 phases of a scene, each bare release has the listed range of an error or of a count."""
    rows = MEASURED[engine, version]
    found = run_bare(release_cache, engine, version, tmp_path, sorted({name for name, *_ in rows}))
    for name, measure, least, most in rows:
        values = measure(all_scenes()[name].scene, found[name])
        assert len(values) == PHASES
        # As the numbers are rounded; places and velocities in 32 bits are known to a millionth.
        assert (min(values), max(values)) == pytest.approx((least, most), rel=1e-3, abs=1e-6), (name, measure.__name__)


@each(
    "engine, old, new, rounding",
    [
        ("pymunk", "6.3.0", "7.3.1", 0.0),
        ("pymunk", "5.7.0", "6.3.0", 1e-14),
        ("planck", "1.0.5", "1.5.0", 0.0),
        ("mujoco", "3.0.0", "3.3.0", 0.0),
        ("mujoco", "3.3.0", "4.0.0", 1e-13),
    ],
)
def test_bare_engine_states_are_equal_in_two_releases(
    engine: str, old: str, new: str, rounding: float, release_cache: ReleaseCache, tmp_path: Path
) -> None:
    """Bare final states in every scene at 32 phases are equal in both releases, or equal to rounding."""
    before, after = (run_bare(release_cache, engine, version, tmp_path, SCENES) for version in (old, new))
    assert len(before) == len(find_scenes(SCENES))
    for name, runs in before.items():
        assert len(runs) == PHASES
        for one, other in zip(runs, after[name], strict=True):
            assert np.abs(np.subtract(one["end"], other["end"])).max() <= rounding, name


@each(
    "version, slow, slower",
    [
        ("0.11.2", (0.906, 1.0), (0.406, 0.906)),
        ("0.13.1", (0.625, 1.0), (0.040, 0.625)),
        ("0.19.3", (0.625, 1.0), (0.058, 0.625)),
        ("0.20.0", (1.0, 1.0), (1.0, 1.0)),
    ],
)
def test_rapier_releases_lose_slow_rebounds_until_0_20(
    version: str, slow: tuple[float, float], slower: tuple[float, float], release_cache: ReleaseCache
) -> None:
    """Bare Rapier returns the listed least and median share of 1 and 0.2 m/s; 5 and 20 m/s return fully."""
    told = run_program(release_cache, "rapier", version, "rapier_releases.mjs")
    for speed, expected in (("1", slow), ("0.2", slower)):
        found = (min(told[speed]), statistics.median_high(told[speed]))
        assert found == pytest.approx(expected, abs=5e-4), speed  # as they are rounded
    for speed in ("5", "20"):
        assert told[speed] == pytest.approx([1.0] * PHASES, abs=1e-4)


@each("version, shipped, reports", [("0.19.3", 0.186, 1), ("0.20.0", 0, 2), ("0.21.0", 0, 1)])
def test_rapier_releases_exchange_velocities_in_a_row(
    version: str, shipped: float, reports: int, release_cache: ReleaseCache
) -> None:
    """Bare tuned Rapier exchanges velocities in a row at all phases, since 0.20 early; 0.20.0 reports twice."""
    found = run_program(release_cache, "rapier", version, "rapier_releases.mjs", "rows")
    assert max(off for off, *_ in found["shipped"]) == pytest.approx(shipped, abs=5e-4)  # as it is rounded
    assert max(off for off, *_ in found["tuned"]) < 1e-6  # 32-bit floats
    assert [count for _, count, _ in found["tuned"]] == [10 * reports] * PHASES
    early = [steps for *_, steps in found["tuned"]]
    if version == "0.19.3":
        assert max(early) < 0
    else:
        assert (min(early), max(early)) == pytest.approx((0.889, 1.243), abs=5e-4)


@each("version, scaled", [("0.12.0", False), ("0.14.0", True)])
def test_matter_scales_inertia_with_mass_since_0_14(version: str, scaled: bool, release_cache: ReleaseCache) -> None:
    """Until 0.12 `Body.setMass` leaves a body's moment of inertia unchanged; since 0.14 it scales it."""
    made, given = run_program(release_cache, "matter", version, "matter_releases.mjs")
    assert (given == pytest.approx(made)) is scaled


def list_changes(engine: str, versions: str, release_cache: ReleaseCache, *scenes: str) -> dict[str, set[ChangeKind]]:
    """Return the kinds of changes of each release, compared with the release before."""
    plain = [entry.scene for entry in find_scenes(scenes)]
    found = run_history(engine, plain, release_cache, HistoryOptions(versions=[versions], jobs=1))
    if reasons := [one.not_run for one in found.releases if one.not_run]:
        pytest.skip(reasons[0])
    return {step.new.version: {change.kind for change in step.changes.values()} for step in found.transitions}


#: Scenes for releases that should differ in nothing.
SEVERAL = ("paper", "classics/box", "classics/sorting")


@each(
    "engine, versions, scenes, changed",
    [
        ("pymunk", "6.3.0,6.11.1,7.0.0,7.3.1", SEVERAL, {}),
        ("planck", "1.0.5,1.3.0,1.5.0", SEVERAL, {}),
        ("mujoco", "3.0.0,3.3.0", SEVERAL, {}),
        ("jolt", "0.29.0,1.1.0", SEVERAL, {}),
        ("rapier2d", "0.19.3,0.20.0", ["classics/cradle-gaps"], {"0.20.0": ChangeKind.OTHER_SETTINGS}),
        ("mujoco", "3.17.0,4.0.0", ["classics/bullet", "classics/box"], {"4.0.0": ChangeKind.OTHER_SETTINGS}),
        (
            "matter",
            "0.12.0,0.14.0,0.18.0,0.19.0,0.20.0",
            ["classics/sorting"],
            {"0.14.0": ChangeKind.BETTER, "0.19.0": ChangeKind.WORSE},
        ),
    ],
)
def test_history_finds_the_releases_that_changed(
    engine: str, versions: str, scenes: Sequence[str], changed: dict[str, ChangeKind], release_cache: ReleaseCache
) -> None:
    """`carom history` finds the listed changes and no others; without a listed change, no bit changes."""
    for version, kinds in list_changes(engine, versions, release_cache, *scenes).items():
        if version in changed:
            assert changed[version] in kinds
            assert any(kind.is_engine_change for kind in kinds) == changed[version].is_engine_change
        else:
            assert not any(kind.is_engine_change for kind in kinds)
            assert changed or kinds <= {ChangeKind.SAME_BITS, ChangeKind.NOT_RUN}


def test_history_does_not_blame_rapier_0_20_for_double_reports(release_cache: ReleaseCache) -> None:
    """`carom history` does not call 0.20 worse, nor 0.21 changed, where only contacts are reported twice."""
    moved = list_changes("rapier2d", "0.19.3,0.20.0,0.21.0", release_cache, "classics/sorting")
    assert ChangeKind.WORSE not in moved["0.20.0"]
    assert not any(one.is_engine_change for one in moved["0.21.0"])
