"""Settings to paste: what an adapter writes as code of its engine gives the adapter's own digits, run by itself."""

import importlib
import math
import re
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from tests.adapters.engine_scenes import build_floor_scene
from tests.cases import each, long_until, release_after
from tests.hazards.measures import ENGINES
from tests.scene_builders import Named, disc_at, staged, wall_at

import carom_adapters.npm
from carom import Chain, Scene, Wall
from carom.catalogue import all_scenes
from carom.engines.api import Adapter, AdapterError, CodedAdapter, Need, unsupported_reason
from carom.engines.registry import list_adapter_points, load_adapter

State = NDArray[np.float64]


def run_adapter(adapter: Adapter, scene: Scene, profile: str, dt_s: float) -> State:
    """Return x, y, vx, vy and spin of each disc after the steps that cover the scene."""
    world = adapter.prepare(scene, adapter.profiles[profile].settings(dt_s))
    world.advance(scene.step_count(dt_s))
    seen = world.observe()
    world.close()
    spin = np.zeros(len(scene.discs)) if seen.spin_rad_s is None else seen.spin_rad_s
    return np.column_stack([seen.position_m, seen.velocity_m_s, spin])


def run_program(text: str, folder: Path, *, node: bool = False) -> State:
    """Run a program as anybody would who has saved it, in Python or in node, and return what it prints."""
    file = folder / ("pasted.mjs" if node else "pasted.py")
    file.write_text(text)
    command = ["node"] if node else [sys.executable, "-W", "ignore"]
    done = subprocess.run([*command, str(file)], capture_output=True, text=True, check=True)
    rows = [line for line in done.stdout.splitlines() if line[:1] in "-.0123456789"]
    return np.array([[float(word) for word in row.split()] for row in rows])


WRITING = ["pymunk", "pybullet", "mujoco", "box2d"]
OTHERS = [name for name in ENGINES if name not in {"pit", *WRITING}]
#: Of these in Python; the others' programs are modules of node.
PYTHON = ("rapier", "dart", "drake", "ode", "newton")
NPM = Path(carom_adapters.npm.__file__).parent

#: Discs that spin and rub, one of them held, in a corner, under gravity: all that a scene can ask for.
CORNER = staged(
    "a corner",
    disc_at(0.6, 1.0, 2.0, -1.0, r=0.2, m=1.5, spin_rad_s=3.0),
    disc_at(1.5, 0.9, -1.0, 0.5, r=0.3, inertia_factor=0.4),
    disc_at(2.5, 1.0, r=0.25, m=math.inf),
    wall_at(0, 0, 0, 1),
    wall_at(0, 0, 1, 0.1),
    restitution=0.9,
    wall_restitution=0.8,
    friction=0.3,
    wall_friction=0.2,
    gravity_m_s2=(0.0, -9.81),
    duration_s=1.0,
)
#: The discs of the corner among edges, open and closed, thin and thick, each of a material of its own.
EDGES = CORNER.model_copy(
    update={
        "name": "among edges",
        "walls": (
            Chain(points_m=[(-1, -1), (4, -1), (4, 3), (-1, 3)], closed=True, pieces=3, half_width_m=0.05),
            Chain(points_m=[(0, 0.1), (2.5, 0.1), (3, 0.5)], half_width_m=0.02, restitution=0.5, friction=0.1),
            wall_at(-0.5, 0, 1, 0.1, restitution=0.7),
        ),
    }
)
#: Walls of each kind that come and go, one a belt, and a disc among them that does.
_LEGS = [{"from_s": begin, "velocity_m_s": velocity} for begin, velocity in ((0.0, (0.0, 0.0)), (0.31, (0.5, -0.25)))]
TOLD = CORNER.model_copy(
    update={
        "name": "told",
        "discs": (*CORNER.discs[:2], disc_at(2.5, 1.0, r=0.25, m=math.inf, driven=True, legs=_LEGS)),
        "walls": (
            Wall(point_m=(0, 0), normal=(0, 1), legs=[*_LEGS, {"from_s": 0.5, "velocity_m_s": (0.0, 0.125)}]),
            Chain(points_m=[(-1, -1), (-1, 2), (3, 2)], half_width_m=0.05, legs=_LEGS),
        ),
    }
)
BELT = CORNER.model_copy(
    update={"name": "belt", "walls": (Wall(point_m=(0, 0), normal=(0, 1), surface_speed_m_s=2.0), CORNER.walls[1])}
)
#: A fast disc among them is what continuous detection is for.
SCENES = {
    "corner": CORNER,
    "multiple": all_scenes()["paper/multiple"].scene,
    "box": all_scenes()["classics/box"].scene,
    "bullet": all_scenes()["classics/bullet"].scene,
    "damped corner": CORNER.model_copy(update={"gravity_m_s2": (0.0, 0.0), "damping_per_s": 0.4}),
    "damped box": all_scenes()["contact/damped-box"].scene,
    "table": all_scenes()["contact/table-pair"].scene.model_copy(update={"duration_s": 1.5}),  # while it slides
    "seams": build_floor_scene(10, 11 / 16, half_width_m=0.01),
    "edges": EDGES,
    "told": TOLD,
    "belt": BELT,
    "rolling": all_scenes()["contact/rolling-resistance-on-a-slope"].scene,
}


def run_model(text: str, scene: Scene, steps: int) -> State:
    """Load a model in MuJoCo, start it from its keyframe, step it, and return what became of each movable disc."""
    mujoco: Any = importlib.import_module("mujoco")
    model = mujoco.MjModel.from_xml_string(text)
    if "dof_damping" in text:  # as it says itself, of discs on free joints
        for body in range(1, model.nbody):
            dof = model.body_dofadr[body]
            model.dof_damping[dof + 3 : dof + 6] = scene.damping_per_s * model.body_inertia[body]
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, 0)
    mujoco.mj_step(model, data, nstep=steps)
    found = []
    body = 0
    for disc in scene.discs:
        if disc.immovable:
            found.append([*disc.position_m, 0.0, 0.0, 0.0])
            continue
        body += 1
        joint, dof, count = model.body_jntadr[body], model.body_dofadr[body], model.body_dofnum[body]
        at = model.jnt_qposadr[joint]
        spin = data.qvel[dof + count - 1] if scene.arrays.turns else 0.0
        found.append([*data.qpos[at : at + 2], *data.qvel[dof : dof + 2], spin])
    return np.array(found)


@each("scene_name", release_after(1, SCENES))
@each("profile", release_after(1, ["tuned", "default"]))
@each("name", ["pymunk", *long_until(3, ["pybullet", "mujoco", "box2d"])])
def test_printed_code_reproduces_the_adapter_bits(
    named: Named, name: str, profile: str, scene_name: str, tmp_path: Path
) -> None:
    """The printed code, run without Carom, ends with every digit of the adapter's run."""
    adapter, scene = named(name), SCENES[scene_name]
    assert isinstance(adapter, CodedAdapter)
    dt_s = 1 / scene.frame_rate_hz
    own = adapter.profiles[profile].capabilities or adapter.capabilities
    if reason := unsupported_reason(scene, own, dt_s, located=False):
        pytest.skip(reason)
    if name == "mujoco" and scene_name == "told":
        with pytest.raises(AdapterError, match="between steps"):
            adapter.code(scene, adapter.profiles[profile].settings(dt_s), "A heading.")
        return
    text = adapter.code(scene, adapter.profiles[profile].settings(dt_s), "Two lines --\nof a heading.")
    found = run_model(text, scene, scene.step_count(dt_s)) if name == "mujoco" else run_program(text, tmp_path)
    assert_same_end(adapter, scene, profile, text, found)


@each("name", [*WRITING, *PYTHON])
def test_code_of_an_unsupported_scene_is_refused(name: str) -> None:
    """No adapter in Python writes code for a scene that it does not support, whether or not its engine is installed."""
    adapter, scene = load_adapter(name), CORNER.model_copy(update={"tangential_restitution": 0.5})
    assert isinstance(adapter, CodedAdapter)
    with pytest.raises(AdapterError, match="does not support"):
        adapter.code(scene, adapter.profiles["tuned"].settings(1 / 60), "A heading.")


def remove_spin(scene: Scene, restitution: float = 0.9, wall_restitution: float = 0.8, friction: float = 0.0) -> Scene:
    """Return a scene whose discs don't spin, with other coefficients."""
    still = {"spin_rad_s": 0.0, "inertia_factor": 0.5}
    discs = tuple(disc if disc.driven else disc.model_copy(update=still) for disc in scene.discs)
    laws = {"restitution": restitution, "wall_restitution": wall_restitution}
    rubs = {"friction": friction, "wall_friction": friction}
    return scene.model_copy(update={"discs": discs, **laws, **rubs})


#: Restitutions of discs above those of walls and below them: some engines take the larger of two. Drake has 1 alone.
SMOOTH = [
    *(remove_spin(CORNER), remove_spin(CORNER, 0.7, 0.9), remove_spin(CORNER, friction=0.3)),
    *(remove_spin(CORNER, 1.0, 1.0), remove_spin(TOLD)),
    *(SCENES[name] for name in ("multiple", "box", "bullet")),
]


@pytest.mark.engines
@each("name", OTHERS)
def test_printed_code_of_optional_engines_reproduces_the_adapter_bits(named: Named, name: str, tmp_path: Path) -> None:
    """The code of each profile of an optional engine ends with every digit of the adapter, on 3 scenes or more."""
    adapter, node = named(name), name not in PYTHON
    assert isinstance(adapter, CodedAdapter)
    if node:  # a module of node finds its engine next to it
        shutil.copy(NPM / "package.json", tmp_path)
        (tmp_path / "node_modules").symlink_to(NPM / "node_modules")
    for key, profile in adapter.profiles.items():
        if profile.located:
            continue
        own = profile.capabilities or adapter.capabilities
        asked = [one for one in SMOOTH if not unsupported_reason(one, own, 1 / one.frame_rate_hz, located=False)]
        assert len(asked) >= 3
        for scene in asked:
            text = adapter.code(scene, profile.settings(1 / scene.frame_rate_hz), "Two lines --\nof a heading.")
            assert_same_end(adapter, scene, key, text, run_program(text, tmp_path, node=node))


def assert_same_end(adapter: CodedAdapter, scene: Scene, profile: str, text: str, found: State) -> None:
    """A program does not mention Carom, and its final state has every digit of the adapter's own run."""
    expected = run_adapter(adapter, scene, profile, 1 / scene.frame_rate_hz)
    assert "carom" not in text.lower()
    if Need.SPIN not in scene.needs and Need.FRICTION not in scene.needs:
        expected[:, 4] = found[:, 4] = 0.0  # nobody asks how a disc turns that nothing turns
    assert np.isfinite(expected).all()
    assert (np.abs(expected[:, 2:4]) > 0).any()
    np.testing.assert_array_equal(found, expected)


@each("name", OTHERS)
def test_code_is_printed_for_engines_that_are_not_installed(name: str) -> None:
    """Settings code, in Python or for node, needs no installed engine and does not mention Carom."""
    adapter = load_adapter(name)
    assert isinstance(adapter, CodedAdapter)
    for profile in (one for one in adapter.profiles if not adapter.profiles[one].located):
        text = adapter.code(SCENES["box"], adapter.profiles[profile].settings(1 / 60), "A heading.")
        assert "carom" not in text.lower()
        if text.startswith("#"):
            compile(text, name, "exec")
        else:
            assert not re.search(r"\bserve\b", text)
            defined = set(re.findall(r"(?:const|function|class) (\w+)", text))
            assert {"Clock", "contactOf", "pairOf", "wallBody"} <= defined


def test_every_registered_engine_is_tested_for_settings_code() -> None:
    """The engines tested here are exactly those that Carom registers, except pic and pit, which have no settings."""
    own = {name for name, point in list_adapter_points().items() if point.distribution == "carom"} - {"pic", "pit"}
    assert own == {*WRITING, *OTHERS}
