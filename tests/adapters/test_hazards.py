"""What each engine is known to do to its process: refused by name beforehand, or a row that harms no other."""

import math
import re
import sys
from collections.abc import Mapping
from pathlib import Path

import pytest
from tests.cases import each
from tests.in_process_pool import InProcessPool
from tests.processes import run_command
from tests.scene_builders import Named, disc_at, staged

from carom import Scene
from carom.catalogue import all_scenes
from carom.engines.api import Adapter, AdapterError, Setting
from carom.execution.observation.engine_run import observe_run
from carom.model.trace import Outcome
from carom.studies.cross_check.explain import explain
from carom.studies.cross_check.options import Options
from carom.studies.cross_check.plan import build_plan

#: Beyond what any engine simulates; each is refused by its adapter, or by the scene itself.
NAN, INF = math.nan, math.inf


def _build_unvalidated_scene(restitution: float = 1.0, **changes: object) -> Scene:
    """Return a scene of two discs that no validation has seen, as a scene made by other means may be."""
    first, second = disc_at(0, 0, 1), disc_at(3, 0, -1)
    unseen = {"discs": (first.model_copy(update=changes), second), "restitution": restitution}  # not validated
    return staged("unchecked", first, second, duration_s=1.0).model_copy(update=unseen)


BAD_SCENES: Mapping[str, list[dict[str, object]]] = {
    "mass_kg": [{"mass_kg": 0.0}, {"mass_kg": -1.0}, {"mass_kg": NAN}],
    "radius_m": [{"radius_m": 0.0}, {"radius_m": -1.0}, {"radius_m": NAN}, {"radius_m": INF}],
    "position_m": [{"position_m": (NAN, 0.0)}, {"position_m": (0.0, INF)}],
    "velocity_m_s": [{"velocity_m_s": (NAN, 0.0)}, {"velocity_m_s": (0.0, INF)}],
    "restitution": [{"restitution": -0.5}, {"restitution": NAN}],
}


@each("field, changes", [(field, change) for field, all_ in BAD_SCENES.items() for change in all_])
def test_invalid_disc_numbers_are_refused_by_field(engine: Adapter, field: str, changes: Mapping[str, object]) -> None:
    """A zero, negative or non-finite number of an unvalidated scene is refused with its field, before the engine."""
    with pytest.raises(AdapterError, match=field):
        engine.prepare(_build_unvalidated_scene(**changes), engine.profiles["tuned"].settings(1 / 60))  # type: ignore[arg-type] # as it is meant


@each(
    "name, change, said",
    [
        *(("pymunk", {name: value}, name) for name, value in (("iterations", 0), ("iterations", -1), ("damping", NAN))),
        ("pymunk", {"collision_bias": -1.0}, "collision_bias"),
        ("pymunk", {"dt_s": 1e101}, "pymunk: dt_s must be at most 1e+100, got 1e+101"),
        ("pymunk", {"dt_s": 1e-101}, "pymunk: dt_s must be at least 1e-100, got 1e-101"),
        *(("pybullet", {name: value}, name) for name, value in (("numSolverIterations", 0), ("contactSlop", NAN))),
        ("pybullet", {"dt_s": 1e-16}, "PyBullet: dt_s must be at least 1e-15, got 1e-16"),
        # All worlds of a process would share it.
        ("pybullet", {"contactBreakingThreshold": 0.1}, "no setting 'contactBreakingThreshold'"),
        ("pybullet", {"shape": "cube"}, "PyBullet: shape must be one of sphere, cylinder, got 'cube'"),
        *(("box2d", {name: value}, name) for name, value in (("velocityIterations", -1), ("velocity_scale", 0.0))),
        ("box2d", {"dt_s": 1e17}, "Box2D: dt_s must be at most 1e+12, got 1e+17"),
        ("box2d", {"sweep": "all"}, "Box2D: sweep must be one of none, shipped, fast, got 'all'"),
        *(("mujoco", {name: value}, name) for name, value in (("joints", "hinge"), ("integrator", "magic"))),
        ("mujoco", {"cone": 1.0}, "MuJoCo: cone must be one of pyramidal, elliptic, got 1.0"),
    ],
)
def test_invalid_setting_is_refused_by_name(name: str, change: dict[str, Setting], said: str, named: Named) -> None:
    """A setting that the engine does not support is refused; the message names it, its range and its value."""
    adapter = named(name)
    settings = {**adapter.profiles["tuned"].settings(1 / 60), **change}
    with pytest.raises(AdapterError, match=re.escape(said)):
        adapter.prepare(_build_unvalidated_scene(), settings)


@each("dt_s", [0.0, -1.0, NAN, INF])
def test_invalid_step_is_refused(engine: Adapter, dt_s: float) -> None:
    """A step that is not a positive finite number is refused with `dt_s` in the message."""
    settings = {**engine.profiles["tuned"].settings(1 / 60), "dt_s": dt_s}
    with pytest.raises(AdapterError, match="dt_s"):
        engine.prepare(_build_unvalidated_scene(), settings)


def _build_struck_scene(speed_m_s: float) -> Scene:
    """A light disc at rest, which a heavy one makes nearly twice as fast as itself."""
    discs = [disc_at(0, 0, speed_m_s, r=1, m=1000), disc_at(4, 0, r=1)]
    return staged("struck", *discs, duration_s=4 / speed_m_s)


def test_plan_skips_pybullet_default_above_its_speed_limit(named: Named) -> None:
    """At 150 m/s the plan skips PyBullet's default profile, names the limit of 100 m/s, and runs the tuned one."""
    named("pybullet")
    scenes, asked = [_build_struck_scene(150.0)], Options(["pybullet"], [1 / 60], ["default", "tuned"])
    plan = build_plan(scenes, asked, InProcessPool())
    default, tuned = list(explain(plan))[-2:]
    assert "default: skipped: a disc moves at 150 m/s, and this method's limit is 100 m/s" in default
    assert "tuned: run at" in tuned


@pytest.mark.long
def test_gas_of_free_spheres_leaves_the_plane_in_mujoco(mujoco: Adapter) -> None:
    """With free joints rounding drives a disc off the plane, with a warning; tuned slide joints complete."""
    scene = all_scenes()["engines/gas-of-25"].scene
    left = observe_run(mujoco, scene, "default", 1 / 60)
    assert left.outcome is Outcome.WARNED
    assert "out of the plane" in left.notes[0]
    assert observe_run(mujoco, scene, "tuned", 1 / 60).outcome is Outcome.COMPLETED


SHORT_OF_MEMORY = """
import resource
from pathlib import Path
from tests.scene_builders import disc_at, staged
from carom.engines.api import AdapterError
from carom.engines.registry import load_adapter

adapter = load_adapter("mujoco")
settings = adapter.profiles["tuned"].settings(1 / 60)

def build_scene(count):
    return staged("row", *(disc_at(2.0 * k, 0) for k in range(count)), duration_s=0.1)

adapter.prepare(build_scene(2), settings).close()
held = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
most = held + 20 * 2**20  # dense, five hundred discs ask for more
resource.setrlimit(resource.RLIMIT_AS, (most, most))
try:
    adapter.prepare(build_scene(500), settings)
except AdapterError as error:
    print(error)
"""


@pytest.mark.long
def test_mujoco_out_of_memory_is_an_adapter_error(named: Named) -> None:
    """A model that does not fit into memory is refused with the number of discs, and the process survives."""
    named("mujoco")
    if not Path("/proc/self/statm").exists():
        pytest.skip("the memory of a process is read from /proc, which is not here")
    done = run_command([sys.executable, "-c", SHORT_OF_MEMORY])
    assert done.stdout.startswith("MuJoCo refuses the scene of 500 discs: ")
    assert "Could not allocate memory" in done.stdout
