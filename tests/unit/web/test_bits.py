"""The page's core in WebAssembly is that of the sources, and its PIC and PIT have the bits of Python's, in node."""

import json
import random
import re
import shutil
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests.cases import each, release_after
from tests.packaging import core_wasm
from tests.processes import run_command
from tests.random_scenes import KINDS, draw_scene, draw_slope_scene, draw_table, draw_table_friction_scene
from tests.scene_builders import build_crushed_rows, disc_at, staged
from tests.transformed_scenes import in_units

import carom
from carom.catalogue import all_scenes
from carom.model.trace import NO_EDGE, Trace
from carom.web import page
from carom.web.page import SOURCES

HERE = Path(__file__).parent
#: Enough of the impacts of the longest scenes.
MOST = 2500

Job = tuple[carom.Scene, str]


def _find_node() -> str:
    found = shutil.which("node")
    if found is None:
        pytest.skip("there is no node here to run the page's JavaScript in: install Debian's package nodejs")
    return found


def _to_bits(numbers: Any) -> str:
    return np.asarray(numbers, dtype="<f8").tobytes().hex()


_KNOWN = dict[tuple[str, str], dict[str, Any]]()


def _run_in_carom(scene: carom.Scene, method: str) -> dict[str, Any]:
    """What Carom makes of a scene, solved once: no two scenes of these tests have one name."""
    if (scene.name, method) not in _KNOWN:
        _KNOWN[scene.name, method] = _solve_scene(scene, method)
    return _KNOWN[scene.name, method]


def _solve_scene(scene: carom.Scene, method: str) -> dict[str, Any]:
    """What Carom makes of a scene, in the words of `bits.mjs`."""
    scene = carom.Scene.model_validate_json(scene.model_dump_json())  # drops the sign of a zero that is a default
    trace: Trace = carom.solve_pic(scene, max_impacts=MOST) if method == "pic" else carom.solve_pit(scene)
    rows = trace.impacts
    names = [name for name in rows.dtype.names or () if name not in ("first", "second")]
    edges = [NO_EDGE] * len(rows) if trace.edges is None else trace.edges.tolist()
    states = [trace.final_position_m, trace.final_velocity_m_s, trace.final_spin_rad_s]
    return {
        "outcome": trace.outcome.name.lower(),
        "bodies": [[int(row["first"]), int(row["second"])] for row in rows],
        "edges": [list(edge) for edge in edges],
        "floats": [_to_bits(np.hstack([row[name] for name in names])) for row in rows],
        "spins": None if trace.spins is None else [_to_bits(list(row)) for row in trace.spins.tolist()],
        "ambiguous": list(trace.ambiguous),
        "modes": [] if trace.modes is None else [_encode_mode(row) for row in trace.modes],
        "final": _to_bits(np.hstack([state.ravel() for state in states if state is not None])),
    }


def _encode_mode(row: np.void) -> list[Any]:
    numbers = [int(row[name]) for name in ("impacts", "disc", "wall", "before", "after")]
    floats = ("time_s", "position", "velocity", "acceleration", "spin", "spin_rate")
    return [numbers, _to_bits(np.hstack([row[name] for name in floats]))]


def _list_different_runs(jobs: Sequence[Job], folder: Path = SOURCES) -> list[str]:
    """Name the runs in JavaScript that differ from Carom's in any bit."""
    scenes = [(json.loads(scene.model_dump_json()), method) for scene, method in jobs]
    lines = [json.dumps({"scene": scene, "method": method, "most": MOST}) for scene, method in scenes]
    done = run_command([_find_node(), HERE / "bits.mjs", folder], input="\n".join(lines), check=False)
    assert done.returncode == 0, done.stderr
    return [
        f"{scene.name} by {method}: {got.get('refused') or sorted(key for key in want if got.get(key) != want[key])}"
        for (scene, method), got in zip(jobs, map(json.loads, done.stdout.splitlines()), strict=True)
        if got != (want := _run_in_carom(scene, method))
    ]


def _list_catalogue_jobs() -> list[Job]:
    return [(entry.scene, method) for entry in all_scenes().values() for method in ("pic", "pit")]


@each("one_in", release_after(1, [16, 1]))
def test_page_reproduces_the_catalogue_to_the_bit(one_in: int) -> None:
    """Every time, normal, velocity, spin, mode and final state of PIC and PIT in the page has the bits of Python."""
    assert _list_different_runs([job for k, job in enumerate(_list_catalogue_jobs()) if k // 2 % one_in == 0]) == []


def test_page_refuses_an_unknown_field_by_name() -> None:
    """The page refuses a scene or wall with a field that it does not support, and names it."""
    scene = {"name": "s", "discs": [{"position_m": [0.0, 0.0], "radius_m": 1.0}], "duration_s": 1.0}
    wall = {"point_m": [0.0, -3.0], "normal": [0.0, 1.0], "bounce": 2.0}
    changes: dict[str, dict[str, Any]] = {"bounce": {"walls": [wall]}, "drag": {"drag": 0.1}}
    lines = "\n".join(json.dumps({"scene": {**scene, **change}, "method": "pic"}) for change in changes.values())
    done = run_command([_find_node(), HERE / "bits.mjs", SOURCES], input=lines)
    assert [json.loads(line) for line in done.stdout.splitlines()] == [{"refused": [name]} for name in changes]


#: Laws of random scenes, in turn.
_LAWS: list[dict[str, Any]] = [
    {"gravity_m_s2": (0.5, -9.81), "wall_rolling_resistance": 0.1, "wall_tangential_restitution": 0.0},
    {"damping_per_s": 0.3},
    {},
]


def _draw_scenes(seed: int) -> list[carom.Scene]:
    """Draw a scene of each kind, two with finite walls, one on a table, one on a slope, and one in extreme units."""
    law = {**_LAWS[seed % 3], "duration_s": 4.0}
    plain = [draw_scene(kind, seed, rough=seed % 2 == 1) for kind in KINDS]
    exponent = (-300, -230, 210, 260)[seed % 4]
    extreme = in_units(draw_scene("anywhere", seed + 1000), length=2.0**exponent, time=2.0**100)
    return [
        *(scene.model_copy(update={**law, "duration_s": min(scene.duration_s, 4.0)}) for scene in plain),
        draw_table("table", seed).model_copy(update=law),
        draw_table("driven table", seed).model_copy(update={**law, "damping_per_s": 0.0}),
        draw_table_friction_scene(seed),
        draw_slope_scene(seed, gives_back=True),
        extreme,
    ]


def _build_arc_scene(bulge: float) -> carom.Scene:
    """Return a scene of a disc that falls onto an arc of more than half a circle, near its end, next to a circle."""
    arc = carom.Chain(points_m=[(0.5, -0.25), (0.5, 0.25)], bulges=[bulge])
    circle = carom.Chain(points_m=[(-3.0, 0.0), (-2.0, 0.0)], bulges=[1.0, 1.0], closed=True)
    return staged(f"arc {bulge}", disc_at(0.3, 3.0, 0.0, -1.0, r=0.25), arc, circle, duration_s=5.0)


@each("seeds", release_after(1, [range(2), range(2, 50)]))
def test_page_reproduces_random_scenes_to_the_bit(seeds: range) -> None:
    """Random scenes of every kind, on tables and of extreme sizes have the bits of Python."""
    scenes = [scene for seed in seeds for scene in _draw_scenes(seed)]
    scenes += [_build_arc_scene(1.5 + seeds.start), _build_arc_scene(-2.0 - seeds.start)]
    assert _list_different_runs([(scene, method) for scene in scenes for method in ("pic", "pit")]) == []


@each("rows", [build_crushed_rows()[::3], pytest.param(build_crushed_rows(), marks=pytest.mark.release)])
def test_page_reproduces_crushed_rows_to_the_bit(rows: list[tuple[carom.Scene, float]]) -> None:
    """Rows of discs that are crushed between mallets and walls have the bits of Python, up to the crush."""
    assert _list_different_runs([(scene, "pic") for scene, _ in rows]) == []


_IMPORT = re.compile(r'^import (?:\{([^}]*)\} from )?"\./(\w+)\.js";$', re.MULTILINE)
_EXPORT = re.compile(r"^export (?:(?:async )?function\*?|class) (\w+)|^export \{([^}]*)\}", re.MULTILINE)
_CONSTANTS = re.compile(r"^export const (.*?);(?: //[^\n]*)?$", re.MULTILINE | re.DOTALL)


def _parse_names(listed: str) -> set[str]:
    return {name.split(" as ")[-1].strip() for name in listed.split(",") if name.strip()}


def test_page_modules_import_only_from_earlier_modules() -> None:
    """Each import in the page's scripts names an export of an earlier module, so that there are no cycles."""
    exported: dict[str, set[str]] = {}
    for module in page.MODULES:
        text = (page.SOURCES / f"{module}.js").read_text(encoding="utf-8")
        imports = _IMPORT.findall(text)
        assert len(imports) == len(re.findall(r"^import\b", text, re.MULTILINE)), f"{module}: an import is not read"
        for listed, source in imports:
            assert source in exported, f"{module} imports {source}, which comes after it"
            assert _parse_names(listed) <= exported[source], f"{module} imports from {source} what that does not export"
        single = {name for name, _ in _EXPORT.findall(text) if name}
        listed_names = set().union(*(_parse_names(listed) for _, listed in _EXPORT.findall(text)))
        constants = set(re.findall(r"(?:^|,\n  )(\w+) =", "\n".join(_CONSTANTS.findall(text)), re.MULTILINE))
        exported[module] = single | listed_names | constants


def test_joined_page_script_is_valid(tmp_path: Path) -> None:
    """The page's modules are joined to one script that Node accepts, so no name is declared twice."""
    script = tmp_path / "page.mjs"
    script.write_text(page.build_page_script(), encoding="utf-8")
    run_command([_find_node(), "--check", script])


def test_every_module_is_in_the_page() -> None:
    """Each JavaScript file is in the page's list of modules, except the loader, which comes before them."""
    assert {path.stem for path in page.SOURCES.glob("*.js")} == {*page.MODULES, "unpack_blocks"}
    assert len(page.MODULES) == len(set(page.MODULES))


def test_packed_blocks_are_unpacked_unchanged() -> None:
    """The page's LZMA decoder returns the original bytes of the core, of repeated text and of noise."""
    noise = random.Random("noise").randbytes(5000)
    contents = [page.CORE.read_bytes()[:20_000], b"ab" * 3000 + b"c", noise, noise[:7] * 99, b"<"]
    lines = "\n".join(page.pack_block(content) for content in contents)
    assert "<" not in lines
    done = run_command([_find_node(), HERE / "unpacks.mjs", SOURCES / "unpack_blocks.js"], input=lines)
    assert [bytes.fromhex(line) for line in done.stdout.splitlines()] == contents


@each("change", release_after(1, ["letter", "length", "end"]))
def test_damaged_block_is_refused(change: str) -> None:
    """A block with a changed length, content or end raises a RangeError that the page is damaged."""
    block = page.pack_block(b"the content of a block" * 10)
    letters = {"length": block[:2] + "}}}}" + block[6:], "letter": block[:30] + "@" + block[31:], "end": block[:40]}
    program: list[str | Path] = [_find_node(), HERE / "unpacks.mjs", SOURCES / "unpack_blocks.js"]
    done = run_command(program, input=f"{block}\n{letters[change]}", check=False)
    assert "RangeError: this page is damaged" in done.stderr


# `core.wasm`, the core that the page contains: it is of the sources next to it, and is rebuilt to the same bytes ------


def test_committed_wasm_matches_the_sources() -> None:
    """The digest in core.wasm is that of the sources, flags and compiler; ``make generated`` writes the file."""
    assert core_wasm.read_sources_digest(core_wasm.CORE_WASM.read_bytes()) == core_wasm.compute_sources_digest()


@pytest.mark.release
def test_wasm_build_is_reproducible(tmp_path: Path) -> None:
    """The pinned compiler builds the committed core.wasm from the sources, in any folder."""
    shutil.copytree(core_wasm.ROOT / "src/carom/core", tmp_path / "src/carom/core")
    assert core_wasm.build(tmp_path) == core_wasm.CORE_WASM.read_bytes()
