"""The page's core in WebAssembly is that of the sources, and its PIC and PIT have the bits of Python's, in node."""

import json
import math
import random
import re
import shutil
import subprocess
from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests.cases import each, long_until, release_after
from tests.packaging import core_wasm
from tests.processes import run_command
from tests.random_scenes import KINDS, TABLES, draw_scene, draw_slope_scene, draw_table_friction_scene
from tests.scene_builders import build_crushed_rows, disc_at, staged, wall_at
from tests.unit.solvers.test_finite_walls import draw_pushed_disc, draw_sliding_disc, draw_wide_disc
from tests.validation.test_contact import build_landing_scene

import carom
from carom.catalogue import all_scenes
from carom.model.trace import NO_EDGE, Trace
from carom.model.walls import Leg
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


#: Faults in modules of the page: the module, its text, and the text with a rounding fault.
_FAULTS = [
    ("rational.js", "ROOT_BITS = 160", "ROOT_BITS = 52"),
    ("chain_geometry.js", "Math.sqrt(nearest(", "Math.fround(nearest("),
    ("features.js", "nearestRoot(ex, length2)]", "along[0][0] / Math.sqrt(along[0][0] ** 2 + along[1][0] ** 2)]"),
    ("obstacles.js", "begin, end, ...moved", "begin, end, ...moved.map(Math.fround)"),
    ("wasm_core.js", "core.damped(rate, time)", "-Math.log1p(-rate * time) / rate"),
]


@each("module, old, new", long_until(1, _FAULTS))
def test_comparison_finds_a_rounding_fault_in_the_page(module: str, old: str, new: str, tmp_path: Path) -> None:
    """A rounding fault in a module of the page changes bits of a run, and the comparison finds it."""
    for source in SOURCES.iterdir():
        if source.suffix in {".js", ".wasm", ".json"}:
            shutil.copy(source, tmp_path)
    text = (tmp_path / module).read_text(encoding="utf-8")
    assert old in text
    (tmp_path / module).write_text(text.replace(old, new), encoding="utf-8")
    places = ("tables/", "driven/", "contact/", "walls/")
    jobs = [job for job in _list_catalogue_jobs() if job[0].name.startswith(places)]
    few: list[Job] = [(all_scenes()["tables/fagnano"].scene, "pic")]
    many = [*jobs, *_build_table_jobs(range(12)), *_build_random_jobs(range(4, 5))]
    assert _list_different_runs(few, tmp_path) or _list_different_runs(many, tmp_path)


def _draw_scene(kind: str, seed: int) -> carom.Scene:
    """Draw a random scene.

    One in four scenes has friction, one has gravity, and one has both. Two in eight are damped.
    """
    rough, falls = seed % 2 == 1, seed % 4 > 1
    scene = draw_scene(kind, seed, rough=rough, gravity=(0.5, -9.81) if falls else (0.0, 0.0))
    fields = {"name": f"{scene.name} {rough} {falls}", "duration_s": min(scene.duration_s, 6.0)}
    return scene.model_copy(update={**fields, "damping_per_s": 0.3 if seed % 8 in {1, 4} else 0.0})


def _draw_table(seed: int) -> carom.Scene | None:
    """Draw discs among edges, arcs and circles.

    One in four scenes has gravity, one has driven bodies, and one has both.
    """
    rnd = random.Random(f"in the page {seed}")
    try:
        scene = TABLES["table"](rnd)
        walls, discs = list(scene.walls), list(scene.discs)
        if seed % 4 > 1:
            k, way = rnd.randrange(len(walls)), (rnd.choice((0.25, -0.5)), rnd.uniform(-0.5, 0.5))
            path: dict[str, Any] = {"legs": _draw_legs(rnd)} if rnd.random() < 0.5 else {"velocity_m_s": way}
            walls[k] = walls[k].model_copy(update={**path, "surface_speed_m_s": rnd.choice((0.0, -0.75))})
            still = {"driven": True, "mass_kg": math.inf}
            path = {"legs": _draw_legs(rnd), "velocity_m_s": (0.0, 0.0)} if rnd.random() < 0.5 else {}
            discs = [disc.model_copy(update={**still, **path} if i == 1 else {}) for i, disc in enumerate(discs)]
        walls += [
            carom.Chain(points_m=[(0, -0.5), (0, 0.5)], bulges=[rnd.choice((1.5, -2.5))]),  # more than half a circle
            carom.Chain(points_m=[(5.5, -6), (6.5, -6)], bulges=[1.0, 1.0], closed=True),  # one circle
        ]
        falls = {"gravity_m_s2": (0.25, -2.0), **_draw_resistance(rnd)} if seed % 2 else {}
        falls |= {"damping_per_s": 0.25} if seed % 8 == 0 else {}
        fields = {"name": f"table {seed}", "duration_s": 4.0, "walls": walls, "discs": discs, **falls}
        return carom.Scene(**{**dict(scene), **fields})
    except carom.SceneError:
        return None


def _draw_legs(rnd: random.Random) -> tuple[Leg, ...]:
    ways = ((begin_s, (rnd.uniform(-0.5, 0.5), rnd.choice((0.0, 0.25)))) for begin_s in (0.0, 0.7, 1.9))
    return tuple(Leg(from_s=begin_s, velocity_m_s=way) for begin_s, way in ways)


def _draw_resistance(rnd: random.Random) -> dict[str, float]:
    return rnd.choice(({}, {"wall_rolling_resistance": 0.1, "wall_tangential_restitution": 0.0}))


def _build_table_jobs(seeds: range) -> list[Job]:
    drawn = [scene for seed in seeds if (scene := _draw_table(seed)) is not None]
    return [(scene, how) for scene in (_build_crushed_scene(), _build_hooked_scene(), *drawn) for how in ("pic", "pit")]


def _build_crushed_scene() -> carom.Scene:
    """A wall presses a disc against another wall and crushes the disc after infinitely many impacts."""
    walls = wall_at(-1.0, 0.0, 1.0, 0.0), wall_at(1.0, 0.0, -1.0, 0.0, velocity_m_s=(-0.5, 0.0))
    return staged("crushed", disc_at(0.0, 0.0, 1.0, r=0.25), *walls, duration_s=5.0)


def _build_hooked_scene() -> carom.Scene:
    """A disc falls onto an arc of more than half a circle, near its end."""
    arc = carom.Chain(points_m=[(0.5, -0.25), (0.5, 0.25)], bulges=[-2.0])
    return staged("hooked", disc_at(0.3, 3.0, 0.0, -1.0, r=0.25), arc, duration_s=5.0)


def _build_random_jobs(seeds: range) -> list[Job]:
    return [(_draw_scene(kind, seed), how) for seed in seeds for kind in KINDS for how in ("pic", "pit")]


def test_page_reproduces_random_scenes_to_the_bit() -> None:
    """Random scenes of every kind, tables, extreme sizes, and sliding or slowed discs have the bits of Python."""
    tables = _build_table_jobs(range(2, 4))  # driven, and driven and falling
    assert len(tables) == 8
    slips = [(draw_slope_scene(seed, gives_back=True), "pic") for seed in range(2)]
    slips += [(build_landing_scene(regain, 1e19), "pic") for regain in (-1.0, 0.5)]
    others = [
        *_build_slowing_jobs(range(2)),
        *_build_extreme_jobs(range(3)),
        *_build_gliding_jobs(),
        (_draw_scene("far out", 37), "pic"),
    ]
    assert _list_different_runs([*_build_random_jobs(range(1)), *tables, *slips, *others]) == []


def _build_slowing_jobs(numbers: range) -> list[Job]:
    """Discs that a table slows down."""
    return [(draw_table_friction_scene(number), how) for number in numbers for how in ("pic", "pit")]


def _build_extreme_jobs(numbers: range) -> list[Job]:
    """Scenes of every kind in sizes that are computed in other units."""
    scenes = []
    for number in numbers:
        rnd = random.Random(f"extreme {number}")
        length, time = rnd.choice((-300, -230, 210, 260)), rnd.choice((-100, 0, 100))
        slowed = number % 3 == 2
        base = draw_table_friction_scene(number) if slowed else draw_scene("anywhere", number, rough=number % 2 == 1)
        scenes.append(_scale_scene(base, length, time))
    return [(scene, how) for scene in scenes for how in ("pic", "pit")]


def _scale_scene(scene: carom.Scene, length: int, time: int) -> carom.Scene:
    """Return a scene in which lengths and times are larger by powers of two."""

    def scaled(vector: Sequence[float], exponent: int) -> tuple[float, ...]:
        return tuple(math.ldexp(x, exponent) for x in vector)

    discs = [
        disc.model_copy(
            update={
                "position_m": scaled(disc.position_m, length),
                "velocity_m_s": scaled(disc.velocity_m_s, length - time),
                "radius_m": math.ldexp(disc.radius_m, length),
                "spin_rad_s": math.ldexp(disc.spin_rad_s, -time),
            }
        )
        for disc in scene.discs
    ]
    walls = [
        wall.model_copy(update={"point_m": scaled(wall.point_m, length)})
        for wall in scene.walls
        if isinstance(wall, carom.Wall)
    ]
    more = {
        "name": f"{scene.name} {length} {time}",
        "duration_s": math.ldexp(scene.duration_s, time),
        "frame_rate_hz": math.ldexp(scene.frame_rate_hz, -time),
        "table_deceleration_m_s2": math.ldexp(scene.table_deceleration_m_s2, length - 2 * time),
    }
    return carom.Scene(**{**dict(scene), **more, "discs": discs, "walls": walls})


def _build_gliding_jobs() -> list[Job]:
    """Discs that start to glide along an arc, or are as wide, beyond its circle by a rounding or not; some fall."""
    pulls = ((0.0, 0.0), (1e-9, 0.0))
    drawn = [
        (form(random.Random(n)), form.__name__, n, g)
        for n in range(2)
        for form in (draw_pushed_disc, draw_sliding_disc)
        for g in pulls
    ]
    wides = [draw_wide_disc(n).model_copy(update={"name": f"wide {n}"}) for n in (15, 18, 19, 28)]
    return [(scene, "pic") for scene in wides] + [
        (scene.model_copy(update={"name": f"{name} {n} {g}", "gravity_m_s2": g}), "pic")
        for (scene, _), name, n, g in drawn
        if name == "slid" or g == pulls[0]
    ]


@pytest.mark.release
def test_page_reproduces_crushed_rows_to_the_bit() -> None:
    """Rows of discs that are crushed between mallets and walls have the bits of Python, up to the crush."""
    assert _list_different_runs([(scene, "pic") for scene, _ in build_crushed_rows()]) == []


@pytest.mark.release
@each("first", range(0, 200, 20))
def test_page_reproduces_many_random_scenes_to_the_bit(first: int) -> None:
    """200 random scenes of each kind have the bits of Python in the page."""
    assert _list_different_runs(_build_random_jobs(range(first, first + 20))) == []


@pytest.mark.release
def test_page_reproduces_100_slowing_and_extreme_scenes() -> None:
    """100 scenes with table deceleration and 100 of extreme sizes have the bits of Python in the page."""
    assert _list_different_runs([*_build_slowing_jobs(range(2, 102)), *_build_extreme_jobs(range(3, 103))]) == []


@pytest.mark.release
@each("first", range(4, 404, 100))
def test_page_reproduces_400_tables_to_the_bit(first: int) -> None:
    """400 draws of tables, a quarter of them both driven and falling, have the bits of Python in the page."""
    assert _list_different_runs(_build_table_jobs(range(first, first + 100))) == []


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
    node = shutil.which("node") or pytest.skip("there is no node here to read the script")
    done = subprocess.run([node, "--check", script], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


def test_every_module_is_in_the_page() -> None:
    """Each JavaScript file is in the page's list of modules, except the loader, which comes before them."""
    assert {path.stem for path in page.SOURCES.glob("*.js")} == {*page.MODULES, "unpack_blocks"}
    assert all(first != second for first, second in pairwise(page.MODULES))


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
