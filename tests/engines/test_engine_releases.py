"""What releases of engines do, bare and by `carom history`: it needs the registries, or what was kept of them."""

import json
import math
import os
import statistics
import subprocess
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from docs.figures.history import SCENES
from numpy.typing import NDArray
from tests.cases import each

from carom import solve_pic
from carom.catalogue import find_scenes
from carom.comparator.shifted_scenes import shift_start
from carom.studies.history.compare_cells import ChangeKind
from carom.studies.history.options import HistoryOptions
from carom.studies.history.registry_clients import CLIENTS, ClientError
from carom.studies.history.release_cache import ReleaseCache, open_release_cache
from carom.studies.history.run import run_history

pytestmark = [pytest.mark.engines, pytest.mark.release]

RAPIER = "@dimforge/rapier2d-compat"
#: Given back of 0.2 and of 1 m/s, least and median over 32 phases: slow bounces were lost twice, and came back in 0.20.
COLUMNS = {
    "0.8.0": ((0.406, 0.906), (0.906, 1.0)),
    "0.11.2": ((0.406, 0.906), (0.906, 1.0)),
    "0.12.0": ((0.360, 0.839), (0.839, 1.0)),
    "0.13.1": ((0.040, 0.625), (0.625, 1.0)),
    "0.14.0": ((0.058, 0.625), (0.625, 1.0)),
    "0.19.3": ((0.058, 0.625), (0.625, 1.0)),
    "0.20.0": ((1.0, 1.0), (1.0, 1.0)),
    "0.21.0": ((1.0, 1.0), (1.0, 1.0)),
}


@pytest.fixture(scope="module")
def release_cache() -> Iterator[ReleaseCache]:
    """Releases, kept where `carom history` keeps them."""
    with open_release_cache(4e9) as found:
        yield found


def install_release(release_cache: ReleaseCache, registry: str, package: str, version: str) -> Path:
    try:
        return release_cache.install(CLIENTS[registry], registry, package, version)
    except ClientError as error:
        pytest.skip(str(error))


@each("version", COLUMNS)
def test_rapier_releases_have_the_listed_slow_rebounds(version: str, release_cache: ReleaseCache) -> None:
    """Bare Rapier returns the listed share of 0.2 and 1 m/s over 32 phases; 5 and 20 m/s return fully."""
    folder = install_release(release_cache, "npm", RAPIER, version)
    script = Path(__file__).with_name("rapier_releases.mjs")
    done = subprocess.run(["node", script, folder], capture_output=True, text=True, check=True, env=dict(os.environ))
    told = {float(speed): values for speed, values in json.loads(done.stdout).items()}
    for speed, column in zip((0.2, 1.0), COLUMNS[version], strict=True):
        found = (min(told[speed]), statistics.median_high(told[speed]))
        assert found == pytest.approx(column, abs=5e-4), speed  # as the columns are rounded
    for speed in (5.0, 20.0):
        assert told[speed] == pytest.approx([1.0] * 32, abs=1e-4)


@each("version, shipped, told", [("0.19.3", 0.186, 1), ("0.20.0", 0, 2), ("0.21.0", 0, 1)])
def test_rapier_releases_exchange_velocities_in_a_row(
    version: str, shipped: float, told: int, release_cache: ReleaseCache
) -> None:
    r"""In each release of bare Rapier tuned discs in a row exchange velocities at all 32 phases.

    Release 0.20.0 reports each contact twice. With default settings 0.19.3 is off by 0.186.
    """
    script = Path(__file__).with_name("rapier_releases.mjs")
    command = ["node", str(script), str(install_release(release_cache, "npm", RAPIER, version)), "rows"]
    found = json.loads(subprocess.run(command, capture_output=True, text=True, check=True).stdout)
    assert max(off for off, *_ in found["shipped"]) == pytest.approx(shipped, abs=5e-4)  # as it is rounded
    assert max(off for off, *_ in found["tuned"]) < 1e-6  # 32-bit floats
    assert [count for _, count, _ in found["tuned"]] == [10 * told] * 32
    early = [steps for *_, steps in found["tuned"]]
    assert (
        max(early) < 0 if version == "0.19.3" else (min(early), max(early)) == pytest.approx((0.889, 1.243), abs=5e-4)
    )


def test_history_does_not_blame_rapier_0_20_for_double_reports(release_cache: ReleaseCache) -> None:
    """`carom history` does not call 0.20 worse, nor 0.21 changed, where only contacts are reported twice."""
    moved = list_changes("rapier2d", "0.19.3,0.20.0,0.21.0", release_cache, "classics/sorting")
    assert ChangeKind.WORSE not in moved["0.20.0"]
    assert not any(one.is_engine_change for one in moved["0.21.0"])


def run_bare_matter(version: str, release_cache: ReleaseCache) -> dict[str, list[Any]]:
    """Return what bodies of a release of matter.js are without Carom."""
    script = Path(__file__).with_name("matter_releases.mjs")
    command = ["node", str(script), str(install_release(release_cache, "npm", "matter-js", version))]
    found: dict[str, list[Any]] = json.loads(subprocess.run(command, capture_output=True, text=True, check=True).stdout)
    return found


#: The registry and the package of what `bare` runs.
PACKAGES = {
    "matter": ("npm", "matter-js"),
    "planck": ("npm", "planck"),
    "rapier": ("npm", RAPIER),
    "pymunk": ("pip", "pymunk"),
    "mujoco": ("pip", "mujoco"),
    "dart": ("pip", "dartpy"),
    "newton": ("pip", "newton"),
}


def run_bare(
    engine: str,
    version: str,
    release_cache: ReleaseCache,
    folder: Path,
    names: Sequence[str] = SCENES,
    *,
    asked: str = "",
) -> dict[str, list[Any]]:
    """Return what a release gives at each of 32 phases, without Carom, in the scenes of `docs/results/history.md`."""
    scenes = folder / "scenes.json"
    scenes.write_text(json.dumps([entry.scene.model_dump(mode="json") for entry in find_scenes(names)]))
    registry, package = PACKAGES[engine]
    python = registry == "pip"
    script = Path(__file__).with_name("bare_releases.py" if python else "bare_releases.mjs")
    command = [
        sys.executable if python else "node",
        str(script),
        engine,
        str(install_release(release_cache, registry, package, version)),
    ]
    done = subprocess.run([*command, str(scenes), *filter(None, [asked])], capture_output=True, text=True, check=True)
    found: dict[str, list[Any]] = json.loads(done.stdout.splitlines()[-1])  # pymunk 5 prints a line of its own
    return found


def exact_states(name: str, part: float = 1.0) -> NDArray[np.float64]:
    """Return places and velocities of PIC at each phase: a step after the end, or at the first after a part of it."""
    scene = next(entry.scene for entry in find_scenes([name]))
    dt_s = 1 / scene.frame_rate_hz
    steps = round(scene.duration_s / dt_s) + 1 if part == 1.0 else math.ceil(part * scene.duration_s / dt_s - 1e-9)
    until = {"duration_s": steps * dt_s}
    exact = [solve_pic(shift_start(scene, k / 32 * dt_s).model_copy(update=until)) for k in range(32)]
    return np.array([np.hstack([trace.final_position_m, trace.final_velocity_m_s]) for trace in exact])


def measure_errors(name: str, runs: list[Any], at: slice, over: float) -> list[float]:
    """Return how far the places or velocities of a scene are from those of PIC at the end, over a length or a speed."""
    errors = (np.array([run["end"] for run in runs]) - exact_states(name))[:, :, at]
    return [float(error) / over for error in np.linalg.norm(errors, axis=2).max(axis=1)]


def assert_range(values: NDArray[np.float64], least: float, most: float) -> None:
    """Assert the rounded range of numbers."""
    assert (float(values.min()), float(values.max())) == pytest.approx((least, most), rel=1e-3)


PLACES, VELOCITIES = slice(0, 2), slice(2, 4)
#: How far off equal discs in a row end.
ROW_OF_MATTER = {"0.10.0": 0.206, "0.12.0": 0.206, "0.14.0": 0.109, "0.18.0": 0.109, "0.19.0": 0.238, "0.20.0": 0.238}
#: Least and most over 32 phases, to 0.12 and from 0.14 on: velocities over the fastest, metres, and turns, of 8.
VELOCITIES_OF_MATTER = {
    "paper/late": (16.25**0.5, (0.01214, 0.01226), (0.01942, 0.02149)),
    "classics/oblique-3-4-5": (5.0, (0.08188, 0.08296), (0.08304, 0.08657)),
    "classics/cradle-gaps": (2.0, (0.09371, 0.09371), (0.07441, 0.07441)),
}


@each("version, row", ROW_OF_MATTER.items())
def test_matter_releases_have_the_listed_errors(
    version: str, row: float, release_cache: ReleaseCache, tmp_path: Path
) -> None:
    """Bare matter.js has the listed errors in five scenes, which change at 0.14, and in a row also at 0.19."""
    found = run_bare("matter", version, release_cache, tmp_path)
    new = version not in ("0.10.0", "0.12.0")
    assert measure_errors("classics/sorting", found["classics/sorting"], VELOCITIES, 2.5) == pytest.approx(
        [row] * 32, abs=5e-4
    )
    for name, (fastest, *ranges) in VELOCITIES_OF_MATTER.items():
        errors = measure_errors(name, found[name], VELOCITIES, fastest)
        assert (min(errors), max(errors)) == pytest.approx(ranges[new], abs=5e-6), name  # as they are rounded
    places = measure_errors("classics/box", found["classics/box"], PLACES, 1.0)
    assert (min(places), max(places)) == pytest.approx(((0.598, 0.798), (1.109, 1.500))[new], abs=5e-4)
    ladder = found["classics/restitution-ladder"]
    assert {run["turns"] for run in ladder} == {7 if new else 6}
    errors = measure_errors("classics/restitution-ladder", ladder, VELOCITIES, math.hypot(11.0, 0.3))
    assert errors == pytest.approx([0.3076 if new else 0.0376] * 32, abs=5e-5)


@each(
    "version, apart, fast",
    [
        ("0.12.0", 0.1254, (0.0, 2e-13)),
        ("0.14.0", -0.0040, (4.09e-11, 4.1e-11)),
        ("0.20.0", -0.0040, (4.09e-11, 4.1e-11)),
    ],
)
def test_matter_pushed_inelastic_discs_apart_until_0_12(
    version: str, apart: float, fast: tuple[float, float], release_cache: ReleaseCache, tmp_path: Path
) -> None:
    """With restitution 0 two discs touch once at each of 32 phases; until 0.12 some are then pushed apart."""
    name = "classics/perfectly-inelastic"
    runs = run_bare("matter", version, release_cache, tmp_path, [name])[name]
    errors = [abs(vx - 2.0) for run in runs for _, _, vx, _ in run["end"]]
    assert fast[0] <= min(errors) <= max(errors) <= fast[1]
    assert [run["met"] for run in runs] == [1] * 32
    gaps = [second[0] - first[0] - 0.5 for first, second in (run["end"] for run in runs)]
    assert max(gaps) == pytest.approx(apart, abs=5e-5)
    assert min(gaps) == pytest.approx(-0.0040, abs=5e-5)


@each("version, cradle, together", [("0.19.3", 0.1125, (5.02e-4, 5.03e-4)), ("0.20.0", 0.0, (0.03e-4, 0.27e-4))])
def test_rapier_releases_have_the_listed_cradle_errors(
    version: str, cradle: float, together: tuple[float, float], release_cache: ReleaseCache, tmp_path: Path
) -> None:
    """Bare Rapier has the listed worst error in a cradle and range of errors of discs that go on together."""
    found = run_bare("rapier", version, release_cache, tmp_path)
    errors = measure_errors("classics/cradle-gaps", found["classics/cradle-gaps"], VELOCITIES, 2.0)
    assert max(errors) == pytest.approx(cradle, abs=5e-5)
    places = measure_errors("classics/perfectly-inelastic", found["classics/perfectly-inelastic"], PLACES, 1.0)
    assert (min(places), max(places)) == pytest.approx(together, abs=1e-6)


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
    before, after = (run_bare(engine, version, release_cache, tmp_path) for version in (old, new))
    assert len(before) == len(find_scenes(SCENES))
    for name, runs in before.items():
        assert len(runs) == 32
        for one, other in zip(runs, after[name], strict=True):
            ends = [run["end"] if isinstance(run, dict) else run for run in (one, other)]
            assert np.abs(np.subtract(*ends)).max() <= rounding, name


#: Releases of Newton, bare, with a gap of 0 and restitution on, least and most over 32 phases. The numbers are the
#: energy left after one disc strikes two that touch, and after a cradle that touches. The last is the speed, in metres
#: a second, at which two with restitution 0 separate.
NEWTON_4103 = {
    "1.5.2": {"one-into-two": (1.745, 1.910), "cradle-touching": (0.340, 0.581), "parted": (0.078, 0.152)},
    "1.6.1": {"one-into-two": (1.949, 1.970), "cradle-touching": (0.456, 0.802), "parted": (0.0, 0.0)},
}


@each("version, right", NEWTON_4103.items())
def test_newton_1_6_1_restitution_differs_from_1_5_2(
    version: str, right: dict[str, tuple[float, float]], release_cache: ReleaseCache, tmp_path: Path
) -> None:
    """Since 1.6.1 inelastic discs stay together (newton #4103); shared contacts gain or lose the listed energy."""
    names = ["issues/newton-4103", "classics/one-into-two", "classics/cradle-touching"]
    found = run_bare("newton", version, release_cache, tmp_path, names)
    found_parted = [second[2] - first[2] for first, second in found[names[0]]]
    assert (min(found_parted), max(found_parted)) == pytest.approx(right["parted"], abs=5e-4)  # as they are rounded
    for name in names[1:]:
        discs = next(entry.scene for entry in find_scenes([name])).arrays
        start = float((discs.mass_kg * (discs.velocity_m_s**2).sum(axis=1)).sum())
        left = [float((discs.mass_kg * (np.array(run)[:, 2:] ** 2).sum(axis=1)).sum()) / start for run in found[name]]
        assert (min(left), max(left)) == pytest.approx(right[name.partition("/")[2]], abs=5e-4), name


def test_history_finds_the_changes_of_matter(release_cache: ReleaseCache) -> None:
    """`carom history` calls matter.js 0.14 better and 0.19 worse in a row, and no other release changed."""
    moved = list_changes(
        "matter", "0.10.0,0.12.0,0.14.0,0.17.1,0.18.0,0.19.0,0.20.0", release_cache, "classics/sorting"
    )
    assert ChangeKind.BETTER in moved["0.14.0"]
    assert ChangeKind.WORSE in moved["0.19.0"]
    assert {version for version, moves in moved.items() if any(one.is_engine_change for one in moves)} == {
        "0.14.0",
        "0.19.0",
    }


@each("version, scaled", [("0.12.0", False), ("0.14.0", True), ("0.20.0", True)])
def test_matter_scales_inertia_with_mass_since_0_14(version: str, scaled: bool, release_cache: ReleaseCache) -> None:
    """Until 0.12 `Body.setMass` leaves a body's moment of inertia unchanged; since 0.14 it scales it."""
    made, given = run_bare_matter(version, release_cache)["inertia"]
    assert (given == pytest.approx(made)) is scaled


def test_walls_fill_the_grid_of_matter_before_0_18(release_cache: ReleaseCache) -> None:
    """Before 0.18 a wall of matter.js occupies each grid cell of 48 pixels that it covers; since then none."""
    small, large = run_bare_matter("0.17.1", release_cache)["cells"]
    assert small >= (4800 / 48) ** 2
    assert large >= (9600 / 48) ** 2
    assert run_bare_matter("0.18.0", release_cache)["cells"] == [0, 0]


#: Releases of DART, bare, over 32 phases: the worst row, how far normals lean, the worst of `head-on` and the least of
#: `cradle-gaps`; then fewest and most turns in `box`, `restitution-ladder` and `bank-shot`: 13, 8 and 3 are right.
DART_BARE = {
    "6.16.2": ((1.1768, 0.3764, 7.292e-6, 0.19509), ((0, 0), (1, 1), (1, 2))),
    "6.17.1": ((1.1768, 0.3764, 7.292e-6, 0.19509), ((22, 30), (8, 10), (3, 3))),
    "6.19.5": ((1.1768, 0.3764, 7.292e-6, 0.19509), ((22, 30), (8, 10), (3, 3))),
    "6.20.0": ((4.56e-5, 0.0, 1.687e-5, 4.0e-5), ((13, 13), (8, 8), (3, 3))),
}


@each("version", DART_BARE)
def test_dart_spheres_are_exact_since_6_20(version: str, release_cache: ReleaseCache) -> None:
    """Until 6.19 DART's spheres are meshes: discs leave a box or turn too often; since 6.20 the turns are right."""
    script = Path(__file__).with_name("dart_releases.py")
    command = [sys.executable, str(script), str(install_release(release_cache, "pip", "dartpy", version))]
    told = json.loads(subprocess.run(command, capture_output=True, text=True, check=True).stdout)
    errors, counts = DART_BARE[version]
    found = (max(told["row"]), max(told["leans"]), max(told["head_on"]), min(told["cradle"]))
    assert found == pytest.approx(errors, rel=1e-3)  # as the numbers are rounded
    assert tuple((min(told[name]), max(told[name])) for name in ("box", "ladder", "bank")) == counts


def list_changes(engine: str, versions: str, release_cache: ReleaseCache, *scenes: str) -> dict[str, set[ChangeKind]]:
    """Return what became of the cells of each release since the one before."""
    plain = [entry.scene for entry in find_scenes(scenes)]
    found = run_history(engine, plain, release_cache, HistoryOptions(versions=[versions], jobs=1))
    if reasons := [one.not_run for one in found.releases if one.not_run]:
        pytest.skip(reasons[0])
    return {step.new.version: {change.kind for change in step.changes.values()} for step in found.transitions}


@each(
    "engine, versions",
    [
        ("pymunk", "6.3.0,6.11.1,7.0.0,7.3.1"),
        ("planck", "1.0.5,1.3.0,1.5.0"),
        ("mujoco", "3.0.0,3.3.0"),
        ("jolt", "0.29.0,1.1.0"),
    ],
)
def test_history_finds_no_changed_bit_in_these_releases(
    engine: str, versions: str, release_cache: ReleaseCache
) -> None:
    """In these releases impacts and final states of every cell that runs are equal."""
    moved = list_changes(engine, versions, release_cache, "paper", "classics/box", "classics/sorting")
    assert set.union(*moved.values()) <= {ChangeKind.NOTHING, ChangeKind.NOT_RUN}


@each(
    "engine, before, release, scenes",
    [
        ("rapier2d", "0.19.3", "0.20.0", ["classics/cradle-gaps"]),  # ships another prediction distance
        ("mujoco", "3.17.0", "4.0.0", ["classics/bullet", "classics/box"]),  # tuned asks for speculative contacts
    ],
)
def test_history_separates_other_settings_from_real_changes(
    engine: str, before: str, release: str, scenes: list[str], release_cache: ReleaseCache
) -> None:
    """Changed defaults or requested settings are reported as such, and not as worse or better."""
    moved = list_changes(engine, f"{before},{release}", release_cache, *scenes)[release]
    assert ChangeKind.OTHER_SETTINGS in moved
    assert not any(one.is_engine_change for one in moved)


#: Rapier, tuned, bare, five eighths into a run: a disc's coordinate, and how far off it is over 32 phases, in metres.
TURNED = {
    "paper/late": ((1, 1), (-0.02326, -0.01203), (-0.04059, -0.02906)),
    "classics/oblique-3-4-5": ((0, 1), (0.008483, 0.01793), (0.01866, 0.02833)),
    "classics/sorting": ((3, 0), (-0.1042, -0.04834), (-0.01729, 0.02151)),
}


@each("version, since", [("0.19.3", 0), ("0.20.0", 1), ("0.21.0", 1)])
def test_tuned_discs_of_rapier_turn_earlier_since_0_20(
    version: str, since: int, release_cache: ReleaseCache, tmp_path: Path
) -> None:
    """Bare tuned Rapier has the listed range of position errors in each scene, which changes at 0.20."""
    asked = json.dumps({"lengthUnit": 1024, "normalizedPredictionDistance": 0, "contact_natural_frequency": 0})
    found = run_bare("rapier", version, release_cache, tmp_path, list(TURNED), asked=asked)
    for name, ((disc, axis), *ranges) in TURNED.items():
        later = np.array([run["later"] for run in found[name]])
        assert_range((later - exact_states(name, 0.625))[:, disc, axis], *ranges[since])


#: DART, bare: a disc's coordinate at the end, and how far off it is over 32 phases, until 6.19 and since, metres.
LEANT = {
    "paper/late": ((0, 1), (0.1372, 0.6008), (-0.1243, -0.002226)),
    "paper/wrong-direction": ((0, 1), (-1.463, -0.03755), (0.01733, 1.249)),
    "classics/oblique-3-4-5": ((0, 0), (-1.27, -0.1712), (0.008549, 0.5074)),
}


@each("version, since", [("6.19.5", 0), ("6.20.0", 1)])
def test_dart_releases_have_the_listed_final_positions(
    version: str, since: int, release_cache: ReleaseCache, tmp_path: Path
) -> None:
    """Since 6.20 DART's discs that meet off centre end on the other side of their exact positions."""
    found = run_bare("dart", version, release_cache, tmp_path, list(LEANT))
    for name, ((disc, axis), *ranges) in LEANT.items():
        assert_range((np.array(found[name]) - exact_states(name))[:, disc, axis], *ranges[since])


def test_history_does_not_run_pymunk_before_5_7(release_cache: ReleaseCache) -> None:
    """Pymunk 5.6 reports no contacts to the adapter, so it is not run, since it is older than 5.7."""
    plain = [entry.scene for entry in find_scenes(["classics/box"])]
    found = run_history("pymunk", plain, release_cache, HistoryOptions(versions=["5.6.0", "5.7.0"], jobs=1))
    assert found.releases[0].not_run == "older than 5.7, the oldest release that its adapter supports"
    assert found.completed == found.releases[1:]
