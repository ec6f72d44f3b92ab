"""PIC and PIT in JavaScript give the bits of Carom's: in node, over the catalogue and scenes drawn at random."""

from __future__ import annotations

import json
import shutil
import subprocess
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests.drawn import KINDS, drawn
from tests.lengths import long_after

import carom
from carom.live.page import SOURCES
from carom.scenes import all_scenes
from carom.trace import Trace

HERE = Path(__file__).parent
#: Enough of the impacts of the longest scenes.
MOST = 2000
#: All that the JavaScript refuses, by the names that it says.
REFUSED = {
    *("walls of edges, arcs or circles", "walls of their own material", "driven walls", "driven discs"),
    *("driven bodies whose velocity changes", "walls whose surface runs"),
    *("damping", "rolling resistance", "a table that slows discs down", "numbers of extreme size"),
}

Job = tuple[carom.Scene, str]


def _node() -> str:
    found = shutil.which("node")
    if found is None:
        pytest.skip("there is no node here to run the page's JavaScript in: install Debian's package nodejs")
    return found


def _bits(numbers: Any) -> str:
    return np.asarray(numbers, dtype="<f8").tobytes().hex()


_KNOWN = dict[tuple[str, str], dict[str, Any]]()


def _of_carom(scene: carom.Scene, method: str) -> dict[str, Any]:
    """What Carom makes of a scene, solved once: no two scenes of these tests have one name."""
    if (scene.name, method) not in _KNOWN:
        _KNOWN[scene.name, method] = _solved(scene, method)
    return _KNOWN[scene.name, method]


def _solved(scene: carom.Scene, method: str) -> dict[str, Any]:
    """What Carom makes of a scene, in the words of `bits.mjs`."""
    trace: Trace = carom.solve_pic(scene, max_impacts=MOST) if method == "pic" else carom.solve_pit(scene)
    # Contact that lasts is not ported: the JavaScript ends where it begins.
    count = len(trace.impacts) if trace.modes is None else int(trace.modes["impacts"][0])
    rows = trace.impacts[:count]
    names = [name for name in rows.dtype.names or () if name not in ("first", "second")]
    known = {
        "bodies": [[int(row["first"]), int(row["second"])] for row in rows],
        "floats": [_bits(np.hstack([row[name] for name in names])) for row in rows],
        "spins": None if trace.spins is None else [_bits(list(row)) for row in trace.spins[:count].tolist()],
    }
    final = np.hstack([trace.final_position_m.ravel(), trace.final_velocity_m_s.ravel()])
    return known if trace.modes is not None else {**known, "outcome": trace.outcome.name.lower(), "final": _bits(final)}


def _as_far_as(want: dict[str, Any], got: dict[str, Any]) -> dict[str, Any]:
    """Return what the JavaScript has made of as much as Carom tells: of impacts before contact that lasts."""
    count = len(want["bodies"])
    return {key: got[key][:count] if isinstance(got[key], list) else got[key] for key in want}


def _of_javascript(jobs: Sequence[Job], folder: Path = SOURCES) -> list[dict[str, Any]]:
    lines = [
        json.dumps({"scene": json.loads(scene.model_dump_json()), "method": method, "most": MOST})
        for scene, method in jobs
    ]
    done = subprocess.run(
        [_node(), HERE / "bits.mjs", folder], input="\n".join(lines), capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    return [json.loads(line) for line in done.stdout.splitlines()]


def _unlike(jobs: Sequence[Job], folder: Path = SOURCES) -> list[str]:
    """Name the runs that differ in any bit."""
    found = _of_javascript(jobs, folder)
    assert len(found) == len(jobs)
    return [
        f"{scene.name} by {method}: {sorted(key for key in want if got.get(key) != want[key])}"
        for (scene, method), got in zip(jobs, found, strict=True)
        if "refused" not in got and _as_far_as(want := _of_carom(scene, method), got) != want
    ]


def _catalogue() -> list[Job]:
    return [(entry.scene, method) for entry in all_scenes().values() for method in ("pic", "pit")]


def test_every_scene_of_the_catalogue_has_carom_s_bits() -> None:
    """Every time, normal, velocity, spin and final state of every scene that is not refused is the same float."""
    assert _unlike(_catalogue()) == []


def test_what_is_refused_stands_in_one_list() -> None:
    """A scene of the catalogue is refused for what the list names alone, and one that only has half-planes never is."""
    jobs = [(entry.scene, "pic") for entry in all_scenes().values()]
    for (scene, _), got in zip(jobs, _of_javascript(jobs), strict=True):
        assert set(got.get("refused", ())) <= REFUSED, scene.name
        ported = all(isinstance(wall, carom.Wall) and wall.restitution is wall.friction is None for wall in scene.walls)
        slowed = scene.damping_per_s or scene.wall_rolling_resistance or scene.table_deceleration_m_s2
        ported &= not (slowed or scene.arrays.driven)
        assert ("refused" in got) == (not ported), scene.name


#: Changes of a scene, and what is refused of each.
REFUSALS: list[tuple[dict[str, Any], str]] = [
    ({"damping_per_s": 0.5}, "damping"),
    ({"wall_rolling_resistance": 0.5}, "rolling resistance"),
    ({"table_deceleration_m_s2": 0.5}, "a table that slows discs down"),
    ({"walls": [{"points_m": [[-1.0, -3.0], [1.0, -3.0]]}]}, "walls of edges, arcs or circles"),
    (
        {"walls": [{"point_m": [0.0, -3.0], "normal": [0.0, 1.0], "restitution": 0.5}]},
        "walls of their own material",
    ),
    ({"walls": [{"point_m": [0.0, -3.0], "normal": [0.0, 1.0], "velocity_m_s": [0.0, 1.0]}]}, "driven walls"),
    ({"discs": [{"position_m": [0.0, 0.0], "radius_m": 0.5, "mass_kg": "inf", "driven": True}]}, "driven discs"),
    ({"duration_s": 2.0**201}, "numbers of extreme size"),
    ({"drag": 0.1}, "drag"),
]


def test_a_scene_that_is_not_ported_is_refused_by_name() -> None:
    """What the JavaScript can't do, and a field that it doesn't know, it says by name; it never runs without them."""
    scene = {"name": "s", "discs": [{"position_m": [0.0, 0.0], "radius_m": 1.0}], "duration_s": 1.0}
    lines = "\n".join(json.dumps({"scene": {**scene, **change}, "method": "pic"}) for change, _ in REFUSALS)
    done = subprocess.run(
        [_node(), HERE / "bits.mjs", SOURCES], input=lines, capture_output=True, text=True, check=True
    )
    assert [json.loads(line) for line in done.stdout.splitlines()] == [{"refused": [name]} for _, name in REFUSALS]


@pytest.mark.parametrize(
    ("module", "old", "new"),
    long_after(
        1,
        [
            ("falling.js", "0.5 * gy * dt", "gy * dt * 0.25"),
            ("bodies.js", "const distance = sqrt(dx * dx + dy * dy)", "const distance = Math.hypot(dx, dy)"),
            ("meeting.js", "near + 0.5 * step * (1 + bend * (0.25 + 0.125 * bend))", "near"),
            ("meeting.js", "return t - (gap[0] + p", "return t - 0 * (gap[0] + p"),
            ("flying.js", "(EPOCH_IMPACTS * n)", "(EPOCH_IMPACTS * n + 1)"),
            ("encounter.js", "<< 55n", "<< 51n"),
        ],
    ),
)
def test_a_change_of_the_formula_is_found(module: str, old: str, new: str, tmp_path: Path) -> None:
    """A formula that is the same but for rounding, or wrong by little, does not pass as the same bits."""
    for source in SOURCES.glob("*.js"):
        shutil.copy(source, tmp_path)
    (tmp_path / "package.json").write_text('{"type": "module"}')
    text = (tmp_path / module).read_text(encoding="utf-8")
    assert old in text
    (tmp_path / module).write_text(text.replace(old, new), encoding="utf-8")
    assert _unlike([(_drawn(kind, seed), "pic") for seed in range(4) for kind in KINDS], tmp_path)


def _drawn(kind: str, seed: int) -> carom.Scene:
    """Draw a scene: of four, one is rough, one falls, and one is both."""
    rough, falls = seed % 2 == 1, seed % 4 > 1
    scene = drawn(kind, seed, rough=rough, gravity=(0.5, -9.81) if falls else (0.0, 0.0))
    return scene.model_copy(update={"name": f"{scene.name} {rough} {falls}", "duration_s": min(scene.duration_s, 6.0)})


def _random_unlike(seeds: range) -> list[str]:
    return _unlike([(_drawn(kind, seed), how) for seed in seeds for kind in KINDS for how in ("pic", "pit")])


def test_scenes_drawn_at_random_have_carom_s_bits() -> None:
    """Every kind of scene that is drawn, with friction and spin, under gravity, and with both: no bit differs."""
    assert _random_unlike(range(4)) == []


def test_a_wall_that_is_met_beyond_every_number_is_never_met() -> None:
    """A disc that friction slows to 1e-302 m/s reaches its far wall at no time that a float holds: no impact."""
    assert _unlike([(_drawn("far out", 37), "pic")]) == []


@pytest.mark.long
@pytest.mark.parametrize("first", range(0, 200, 20))
def test_two_thousand_scenes_have_carom_s_bits(first: int) -> None:
    """Two thousand of them, two hundred of each kind."""
    assert _random_unlike(range(first, first + 20)) == []
