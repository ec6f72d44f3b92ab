"""What each engine is known to do to its process: refused by name beforehand, or a row that harms no other."""

import ctypes
import math
import os
import re
import sys
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pytest
from tests.cases import each
from tests.hazards.spread import build_starts
from tests.in_process_pool import InProcessPool
from tests.processes import run_command
from tests.scene_builders import Named, disc_at, staged

from carom import Scene
from carom.catalogue import all_scenes
from carom.engines.api import Adapter, AdapterError, Contact, Setting, unsupported_reason
from carom.execution.adapter_profile import capabilities_of
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


LEAK = """
import ctypes, gc, sys, warnings
warnings.simplefilter("ignore")
from carom import Disc, Scene
from carom.engines.registry import load_adapter

class Mallinfo2(ctypes.Structure):  # malloc.h
    _fields_ = [(name, ctypes.c_size_t) for name in
        "arena ordblks smblks hblks hblkhd usmblks fsmblks uordblks fordblks keepcost".split()]

libc = ctypes.CDLL(None)
libc.mallinfo2.restype = Mallinfo2
adapter = load_adapter(sys.argv[1])
discs = [Disc(position_m=(0, 0), velocity_m_s=(1, 0), radius_m=0.5), Disc(position_m=(1.01, 0), radius_m=0.5)]
# In turn, so that not every world is used again.
scenes = [Scene(name="pair", discs=discs[:n], duration_s=1) for n in (1, 2)]
settings = adapter.profiles["tuned"].settings(1 / 60)

def in_use_after(worlds):
    for k in range(worlds):
        world = adapter.prepare(scenes[k // 5 % 2], settings)
        world.observe()
        world.advance(2)
        world.observe()
        world.close()
    gc.collect()
    heap = libc.mallinfo2()
    return heap.uordblks + heap.hblkhd

warm = in_use_after(200)
print(in_use_after(1000) - warm)
"""


@pytest.mark.long
def test_a_thousand_closed_worlds_leak_no_memory(engine: Adapter) -> None:
    """A closed world leaks less than an empty NumPy array, by all of malloc: glibc keeps resident memory."""
    if not hasattr(ctypes.CDLL(None), "mallinfo2"):
        pytest.skip("what malloc has handed out is asked of glibc 2.33 or later, which is not here")
    done = run_command([sys.executable, "-c", LEAK, engine.name], env={**os.environ, "PYTHONMALLOC": "malloc"})
    assert int(done.stdout.split()[-1]) < 1000 * sys.getsizeof(np.empty(0))


@pytest.mark.long
def test_box2d_runs_with_warnings_as_errors() -> None:
    """With `-W error`, importing Box2D would end the process; the adapter prevents that."""
    program = (
        "from carom import Disc, Scene; from carom.engines.registry import load_adapter; a = load_adapter('box2d');"
        "w = a.prepare(Scene(name='x', discs=[Disc(position_m=(0, 0), radius_m=1)], duration_s=1),"
        " a.profiles['tuned'].settings(1 / 60)); w.advance(1); print(w.observe().position_m.tolist()); w.close()"
    )
    done = run_command([sys.executable, "-W", "error", "-c", program], check=False)
    if "No module named 'Box2D'" in done.stderr:
        pytest.skip("Box2D is not installed")
    assert done.stdout == "[[0.0, 0.0]]\n"


def test_pymunk_adapter_sets_no_callback(named: Named, monkeypatch: pytest.MonkeyPatch) -> None:
    """The adapter gives pymunk no Python callback: `step` would hang in one, and swallow its exceptions."""
    pymunk_adapter = named("pymunk")
    import pymunk

    given: list[str] = []
    for kind, name in (
        (pymunk.Space, "on_collision"),
        (pymunk.Space, "add_post_step_callback"),
        (pymunk.Body, "velocity_func"),
        (pymunk.Body, "position_func"),
    ):
        assert hasattr(kind, name)  # or what is watched for is called otherwise by now
        noted = lambda *_args, name=name, **_kwargs: given.append(name)  # noqa: E731 - one for each name
        monkeypatch.setattr(kind, name, noted if kind is pymunk.Space else property(noted, noted))
    scene = _build_unvalidated_scene()
    for profile in pymunk_adapter.profiles.values():
        world = pymunk_adapter.prepare(scene, profile.settings(1 / 60))
        world.observe()
        contacts: list[Contact] = []
        for _ in range(90):
            world.advance(1)
            contacts += world.observe().contacts
        world.close()
        assert contacts  # seen all the same
    assert given == []


#: Starts, spread evenly over a step of 1/240 s.
PHASES = tuple(k / 16 for k in range(16))


def _build_struck_scene(speed_m_s: float, phase: float = 0.0) -> Scene:
    """A light disc at rest, which a heavy one makes nearly twice as fast as itself."""
    discs = [disc_at(-phase * speed_m_s / 240, 0, speed_m_s, r=1, m=1000), disc_at(4, 0, r=1)]
    return staged("struck", *discs, duration_s=4 / speed_m_s)


def test_pybullet_speed_clamp_is_reported_as_a_warning(pybullet: Adapter) -> None:
    """A disc thrown at 180 m/s is clamped to 100 m/s by default, with a warning, and not with tuned."""
    for phase in PHASES:
        found = {}
        for profile, speed in (("default", 90.0), ("default", 40.0), ("tuned", 90.0)):
            scene = _build_struck_scene(speed, phase)
            assert not unsupported_reason(scene, capabilities_of(pybullet, profile), 1 / 240)
            world = pybullet.prepare(scene, pybullet.profiles[profile].settings(1 / 240))
            assert world.observe().warning == ""
            world.advance(24)
            found[profile, speed] = world.observe()
            world.close()
        assert found["default", 90.0].velocity_m_s[1, 0] == 100
        assert "velocity to 100 m/s, and disc 1 has reached this limit" in found["default", 90.0].warning
        assert found["default", 40.0].velocity_m_s[1, 0] > 70
        assert found["default", 40.0].warning == found["tuned", 90.0].warning == ""
        # Twice the speed of the centre of mass.
        assert found["tuned", 90.0].velocity_m_s[1, 0] == pytest.approx(2 * 90 * 1000 / 1001, rel=1e-9)


def test_plan_skips_pybullet_default_above_its_speed_limit(named: Named) -> None:
    """At 150 m/s the plan skips PyBullet's default profile, names the limit of 100 m/s, and runs the tuned one."""
    named("pybullet")
    scenes, asked = [_build_struck_scene(150.0)], Options(["pybullet"], [1 / 60], ["default", "tuned"])
    plan = build_plan(scenes, asked, InProcessPool())
    default, tuned = list(explain(plan))[-2:]
    assert "default: skipped: a disc moves at 150 m/s, and this method's limit is 100 m/s" in default
    assert "tuned: run at" in tuned


def _build_row_scene(discs: int) -> Scene:
    """Discs in a row, two and two of them approaching."""
    places = [2 * k + (0.49 if k % 2 == 0 else -0.49) for k in range(discs)]
    return staged("row", *(disc_at(x, 0, (-1) ** k) for k, x in enumerate(places)), duration_s=0.1)


@pytest.mark.long
def test_gas_of_free_spheres_leaves_the_plane_in_mujoco(named: Named) -> None:
    """With free joints rounding drives a disc off the plane, with a warning; tuned slide joints complete."""
    starts = build_starts(all_scenes()["engines/gas-of-25"].scene, 16)
    assert len(starts) == 16
    for scene in starts:
        left = observe_run(named("mujoco"), scene, "default", 1 / 60)
        assert left.outcome is Outcome.WARNED
        assert "out of the plane" in left.notes[0]
    assert observe_run(named("mujoco"), starts[0], "tuned", 1 / 60).outcome is Outcome.COMPLETED  # on slides


@pytest.mark.long
def test_mujoco_runs_3001_discs(mujoco: Adapter) -> None:
    """MuJoCo allocates dense matrices for 3,001 discs and resolves 1,500 simultaneous impacts."""
    scene = _build_row_scene(3001)
    world = mujoco.prepare(scene, mujoco.profiles["tuned"].settings(1 / 60))
    world.advance(3)
    end = world.observe()
    world.close()
    assert end.warning == ""
    start = np.array([disc.velocity_m_s for disc in scene.discs])
    assert np.abs(end.velocity_m_s[:3000] + start[:3000]).max() < 1e-9
    assert np.abs(end.velocity_m_s[3000] - start[3000]).max() < 1e-9


SHORT_OF_MEMORY = """
import resource
from pathlib import Path
from tests.adapters.test_hazards import _build_row_scene
from carom.engines.api import AdapterError
from carom.engines.registry import load_adapter

adapter = load_adapter("mujoco")
settings = adapter.profiles["tuned"].settings(1 / 60)
adapter.prepare(_build_row_scene(2), settings).close()
held = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
most = held + 20 * 2**20  # dense, five hundred discs ask for more
resource.setrlimit(resource.RLIMIT_AS, (most, most))
try:
    adapter.prepare(_build_row_scene(500), settings)
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


@each("mass_kg", [1e-20, 1e-3, 7.0, 1e20])
def test_box2d_keeps_extreme_masses(box2d: Adapter, mass_kg: float) -> None:
    """Masses from 1e-20 to 1e20 kg keep their effect in Box2D, and none is replaced by 1 kg."""
    world = box2d.prepare(_build_unvalidated_scene(mass_kg=mass_kg), box2d.profiles["tuned"].settings(1 / 60))
    world.advance(90)
    end = world.observe()
    world.close()
    # Closing at 2 m/s, the centre of mass moves at (m - 1) / (m + 1), and the first disc leaves at 2 V - 1.
    assert end.velocity_m_s[0, 0] == pytest.approx(2 * (mass_kg - 1) / (mass_kg + 1) - 1, abs=1e-6)
