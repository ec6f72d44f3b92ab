"""Runs of engines: required parts of a world, the final state, and several steps in one call."""

import math
from collections.abc import Mapping
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from tests.cases import each, release_after
from tests.scene_builders import disc_at, drive_on_legs, require_value, staged, wall_at
from tests.unit.execution.stubs import Makes, Still

from carom import solve_pic
from carom.catalogue import all_scenes
from carom.engines.registry import load_adapter
from carom.errors import AdapterError
from carom.execution.observation.engine_run import observe_run
from carom.model.scene import Scene, to_scene
from carom.model.trace import Outcome, Trace
from carom.support.limits import LARGEST

DT = 0.25


class UnreadCounts(Still):
    """A world whose counts need an attribute that its engine lacks."""

    @property
    def counts(self) -> Mapping[str, int]:
        engine: Any = SimpleNamespace()
        return {"solved": engine.solved}


def observe_counts(world: Any) -> Mapping[str, int]:
    scene = staged("rest", disc_at(0.0, 0.0), duration_s=1.0)
    return observe_run(Makes(world), scene, "default", DT).counts


def test_missing_engine_attribute_is_reported() -> None:
    """An AttributeError inside a property of a world is raised unchanged, and the world is closed."""
    world = UnreadCounts()
    with pytest.raises(AttributeError, match="solved"):
        observe_counts(world)
    assert world.closed


def test_incomplete_world_is_refused_with_its_missing_parts() -> None:
    """A world without `settings` and `observe` is refused, and the message names both; counts are optional."""
    with pytest.raises(AdapterError, match="a SimpleNamespace has no settings, observe"):
        observe_counts(SimpleNamespace(advance=print, close=print))
    assert "solved" not in observe_counts(Still())


@each("name", ["contact/drop", "contact/rolling-resistance", "contact/incline-rolls"])
@each("steps_per_s", [47, 60])
def test_disc_in_contact_has_the_exact_state_at_the_end(name: str, steps_per_s: int) -> None:
    """PIC's run in steps, observed past the end, equals PIC at the end within 1e-12 for discs in contact."""
    scene = all_scenes()[name].scene
    scene = scene.model_copy(update={"duration_s": scene.duration_s * 0.9973})
    truth, seen = solve_pic(scene), observe_run(load_adapter("pic"), scene, "tuned", 1 / steps_per_s)
    assert seen.end_time_s == scene.duration_s
    assert np.abs(seen.final_velocity_m_s - truth.final_velocity_m_s).max() <= 1e-12
    assert np.abs(seen.final_position_m - truth.final_position_m).max() <= 1e-12
    assert (seen.final_spin_rad_s is None) == (truth.final_spin_rad_s is None)
    if truth.final_spin_rad_s is not None:
        assert np.abs(require_value(seen.final_spin_rad_s) - truth.final_spin_rad_s).max() <= 1e-12


def test_impact_after_the_end_does_not_change_the_final_state() -> None:
    """An impact after the end, in the last step, leaves the final state at the end that of free flight."""
    floor = wall_at(0, 0, 0, 1)
    falls = staged("falls", disc_at(0, 6.55), floor, gravity_m_s2=(0.0, -10.0), duration_s=1.0)
    trace = observe_run(load_adapter("pic"), falls, "tuned", 0.3)
    assert len(trace.impacts) == 0
    assert trace.final_position_m[0, 1] == pytest.approx(1.55, rel=1e-14)
    assert trace.final_velocity_m_s.tolist() == [[0.0, -10.0]]

    way = 2.0 * (1.0 - math.exp(-0.55))
    turns = disc_at(0, 0.5 + way, 0, -1, spin_rad_s=3.0)
    slows = staged("slows", turns, floor, wall_friction=0.5, damping_per_s=0.5, duration_s=1.0)
    trace = observe_run(load_adapter("pic"), slows, "tuned", 0.3)
    assert len(trace.impacts) == 0
    assert trace.final_position_m[0, 1] == pytest.approx(0.5 + way - 2.0 * (1.0 - math.exp(-0.5)), rel=1e-14)
    assert require_value(trace.final_spin_rad_s)[0] == pytest.approx(3.0 * math.exp(-0.5), rel=1e-14)


def test_run_keeps_states_only_if_a_disc_can_rest() -> None:
    """States are kept only if gravity can hold a disc at rest; samples have the positions at every step."""
    bodies = disc_at(0.0, 0.5, 1.0), wall_at(0.0, 0.0, 0.0, 1.0), wall_at(1.0, 0.0, -1.0, 0.0)
    for gravity_m_s2, rests in (((0.0, 0.0), False), ((0.0, -1.0), True)):
        scene = staged("slide", *bodies, gravity_m_s2=gravity_m_s2, duration_s=1.0)
        trace = observe_run(load_adapter("pic"), scene, "tuned", DT, samples=True)
        samples = require_value(trace.samples)
        assert samples.time_s.tolist() == [0.0, 0.25, 0.5, 0.75, 1.0]
        assert samples.position_m[:, 0, 0].tolist() == [0.0, 0.25, 0.5, 0.25, 0.0]
        assert (trace.observed_states is not None) is rests


class OneByOne:
    """A world of another one's steps, without its `take_quiet_steps`."""

    def __init__(self, world: Any) -> None:
        self.settings, self.advance, self.observe = world.settings, world.advance, world.observe
        self.close, self.world = world.close, world

    @property
    def counts(self) -> Mapping[str, int]:
        return getattr(self.world, "counts", {})


ENGINES = ("pic", "pit", "pymunk", "box2d", "mujoco", "pybullet")
_BOX = [wall_at(-3, 0, 1, 0), wall_at(3, 0, -1, 0), wall_at(0, -3, 0, 1), wall_at(0, 3, 0, -1)]
_SPINNING = [disc_at(-1, 0.2, 3, 1, r=0.3, spin_rad_s=5.0), disc_at(1, 0, -2, 0.5, r=0.4, m=2.0, spin_rad_s=-3.0)]
_LEGS = drive_on_legs((0.0, (0.0, 0.0)), (0.31, (1.0, -1.0)), (1.2, (-1.0, 0.0)))
_DRIVEN = disc_at(0, 1.5, r=0.25, m=math.inf, driven=True, **_LEGS)
_ROUGH: dict[str, Any] = {"friction": 0.3, "wall_friction": 0.2, "restitution": 0.9}
#: Scenes in which a state has more than positions and velocities, or changes between contacts.
SCENES = [
    staged("drop", disc_at(0, -2.48, 1), _BOX[2], wall_restitution=0.25, gravity_m_s2=(0.0, -10.0), duration_s=0.5),
    staged("spin and gravity", *_SPINNING, *_BOX, **_ROUGH, gravity_m_s2=(0.0, -5.0), duration_s=1.0),
    staged("legs and spin", _SPINNING[0], _DRIVEN, *_BOX, friction=0.2, duration_s=1.0),
    staged("damping", *_SPINNING, *_BOX, **_ROUGH, damping_per_s=0.5, duration_s=1.0),
    *map(to_scene, ("contact/drop", "paper/missed", "gravity/box", "classics/bullet")),
]


def assert_quiet_steps_change_nothing(engine: str, scene: Scene, profile: str) -> Trace:
    """Compare with a run of single steps. Equal traces have the same bits, counts, notes and outcome."""
    adapter, dt_s = load_adapter(engine), 0.5 / scene.frame_rate_hz
    one_by_one: Any = Makes(OneByOne(adapter.prepare(scene, adapter.profiles[profile].settings(dt_s))))
    one_by_one.name, one_by_one.capabilities, one_by_one.profiles = engine, adapter.capabilities, adapter.profiles
    found = observe_run(adapter, scene, profile, dt_s, samples=True)
    assert found == observe_run(one_by_one, scene, profile, dt_s, samples=True)
    return found


@each("engine", ENGINES)
@each("profile", ["default", "tuned"])
@each("scene", release_after(4, SCENES))
def test_quiet_steps_in_one_call_give_the_same_trace(engine: str, profile: str, scene: Scene) -> None:
    """Many steps in one call give the trace of the same steps one by one, with its states, samples and counts."""
    assert_quiet_steps_change_nothing(engine, scene, profile)


_FALL = staged("fall", disc_at(0, 0), gravity_m_s2=(0.0, -500.0), duration_s=5.0)
_KICK = staged("kick", disc_at(0, 0, m=1e-6), disc_at(-2, 0, 90, m=1e6), gravity_m_s2=(0.0, -1.0), duration_s=1.0)
_FAR = staged("far", disc_at(0, 0, 1e6), gravity_m_s2=(0.0, -1e8), duration_s=100.0, frame_rate_hz=1.0)


@each(
    "engine, profile, scene, note",
    [
        ("box2d", "default", _FALL, "limits motion to 2 m per step"),
        ("pybullet", "default", _KICK, "clamps each component of a multibody's velocity"),
        ("mujoco", "default", _FAR, "reset the state"),
    ],
)
def test_warning_in_quiet_steps_ends_the_run_at_that_step(engine: str, profile: str, scene: Scene, note: str) -> None:
    """A disc too fast for the engine ends the run with a warning at the step at which single steps end it."""
    found = assert_quiet_steps_change_nothing(engine, scene, profile)
    assert found.outcome is Outcome.WARNED
    assert note in found.notes[0]
    assert 0 < found.counts["steps"] < scene.step_count(found.dt_s)


class Lost(Still):
    """A world that loses its disc in its third step, and takes more steps before it is observed."""

    def take_quiet_steps(self, position_m: Any, velocity_m_s: Any, spin_rad_s: Any) -> int:
        position_m[:], velocity_m_s[:], spin_rad_s[:] = 0.0, 0.0, 0.0
        position_m[2] = self.lost
        return len(position_m)

    lost = math.nan


def test_quiet_step_with_a_lost_disc_ends_the_run_before_it() -> None:
    """A state with NaN ends the run one step earlier; one beyond the largest number raises an AdapterError."""
    scene = staged("rest", disc_at(0.0, 0.0), gravity_m_s2=(0.0, -1.0), duration_s=2.0)
    trace = observe_run(Makes(Lost()), scene, "default", DT)
    assert (trace.outcome, trace.counts["steps"]) == (Outcome.NON_FINITE, 2)
    far = Lost()
    far.lost = 1.25 * LARGEST
    with pytest.raises(AdapterError, match="position_m of an Observation must be"):
        observe_run(Makes(far), scene, "default", DT)
