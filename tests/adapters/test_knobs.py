"""Every setting that a tuned profile claims matters does reach its engine: put back, it changes what happens."""

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from tests.adapters.engine_scenes import (
    build_break_scene,
    build_cradle_scene,
    build_floor_scene,
    build_oblique_scene,
    scale_tolerance,
)
from tests.cases import each
from tests.scene_builders import Finish, Named, disc_at, staged

from carom import Scene
from carom.catalogue import catalogue
from carom.engines.api import Adapter, Setting
from carom.engines.api import Knob as SearchedKnob


def test_knobs_accept_the_ends_of_their_ranges(engine: Adapter) -> None:
    """Each end of a searchable range, and each choice, is the value that the world reports as used."""
    knobs: Mapping[str, SearchedKnob] = getattr(engine, "knobs", {})
    assert knobs
    for name, knob in knobs.items():
        for value in knob.choices or (knob.low, knob.high):
            assert value is not None
            world = engine.prepare(build_oblique_scene(), {**engine.profiles["default"].settings(1 / 60), name: value})
            found = world.settings[name]
            world.close()
            near = scale_tolerance(engine, 2.0**-52)
            assert found == value or math.isclose(float(found), float(value), rel_tol=near), (name, value, found)


def at_rate(scene: Scene, frame_rate_hz: float, **changes: float) -> Scene:
    """Return a scene with another frame rate, whose frame is the step."""
    return scene.model_copy(update={"frame_rate_hz": frame_rate_hz, **changes})


FINE, COARSE = at_rate(build_oblique_scene(), 240.0), at_rate(build_oblique_scene(), 16.0)
ROUGH = at_rate(build_oblique_scene(), 240.0, friction=0.1, wall_friction=0.1)
#: At 4 cm/s, below the speeds under which engines ship contacts inelastic.
SLOW = at_rate(build_oblique_scene(time=100.0), 2.4)
#: A disc that is 33 radii on after a step, and meets another on the way.
BULLET = staged("bullet", disc_at(-8.9, 0, 100, r=0.05), disc_at(0, 0.06, r=0.05, m=2), duration_s=0.2)
FAST = staged("fast", disc_at(0, 0, 200, r=1), duration_s=0.1)
FAR = staged("far", disc_at(9.99e9, 0, 1e9, r=1), duration_s=0.1)
INELASTIC = catalogue()["classics/perfectly-inelastic"].scene
SHARED_CONTACT, BREAK = at_rate(build_cradle_scene(), 240.0), at_rate(build_break_scene(), 240.0)
#: The start of sixteen at which pymunk's segments, each on its own, turn the disc aside most.
SEAMS = build_floor_scene(10, 11 / 16)
#: The start of sixteen at which tuned Box2D turns the disc aside at half a metre a second, if edges stand alone.
SLOW_SEAMS = build_floor_scene(10, 10 / 16, 0.5)


@dataclass(frozen=True)
class Knob:
    """A tuned setting put back to what is shipped (or worse), where that shows, and the least that it does there."""

    engine: str
    name: str
    value: Setting
    scene: Scene
    least: float
    of: str = "velocity"

    def __str__(self) -> str:
        return f"{self.engine} {self.name}={self.value}"


#: The least effects are a tenth of what was measured, in metres per second or metres; all are far above rounding,
#: except for an order of solving, and for MuJoCo's tolerance.
KNOBS = [
    Knob("pymunk", "iterations", 10, BREAK, 1e-7),
    Knob("pymunk", "collision_bias", 0.0018, COARSE, 1e-2, of="position"),
    Knob("pymunk", "set_neighbors", 0, SEAMS, 1e-1),
    Knob("pybullet", "linearDamping", 0.04, FINE, 1e-2),
    Knob("pybullet", "useMaximalCoordinates", False, FAST, 1e1),
    Knob("pybullet", "contactERP", 0.08, FINE, 1e-2),
    Knob("pybullet", "contactProcessingThreshold", 1e18, FINE, 1e-1),
    Knob("pybullet", "contactSlop", 1e-5, SHARED_CONTACT, 1e-4),
    Knob("pybullet", "restitutionVelocityThreshold", 0.2, SLOW, 1e-3),
    Knob("pybullet", "deterministicOverlappingPairs", 0, SHARED_CONTACT, 1e-12),
    Knob("pybullet", "solverResidualThreshold", 1e-7, SHARED_CONTACT, 1e-5),
    Knob("pybullet", "numSolverIterations", 10, SHARED_CONTACT, 1e-3),
    Knob("pybullet", "ccd_radius_fraction", 0.0, BULLET, 1e1),
    Knob("mujoco", "joints", "free", BULLET, 1e1),
    Knob("mujoco", "stiffness", 1000.0, FINE, 1e-2),
    Knob("mujoco", "in_turn", False, ROUGH, 1e-2),
    Knob("mujoco", "solimp", "0.9 0.95 0.001 0.5 2", BREAK, 1e-2),
    Knob("mujoco", "integrator", "RK4", FINE, 1e-1),
    Knob("mujoco", "integrator", "discrete", FINE, 1e-1),
    Knob("mujoco", "jacobian", "sparse", BREAK, 1e-1),
    Knob("mujoco", "tolerance", 1e-8, FINE, 1e-13),
    Knob("mujoco", "autoreset", True, FAR, 1e-1),
    Knob("mujoco", "speculative", False, BULLET, 1e1),
    Knob("box2d", "velocity_scale", 1.0, SLOW, 1e-3),
    Knob("box2d", "velocityIterations", 8, SHARED_CONTACT, 1e-3),
    Knob("box2d", "positionIterations", 3, INELASTIC, 1e-3, of="position"),
    Knob("box2d", "sweep", "none", BULLET, 1e1),
    Knob("box2d", "chains", False, SLOW_SEAMS, 1.0),
    Knob("box2d", "polygon_radius_m", 0.01, FINE, 1e-3, of="position"),
]


@each("knob", KNOBS)
def test_tuned_settings_have_an_effect(named: Named, finish: Finish, knob: Knob) -> None:
    """Resetting a tuned setting to its default changes the run by at least the listed amount."""
    adapter, scene, dt_s = named(knob.engine), knob.scene, 1 / knob.scene.frame_rate_hz
    tuned, other = (finish(adapter, scene, dt_s, **changes) for changes in ({}, {knob.name: knob.value}))
    found = {"velocity": other.velocity_m_s - tuned.velocity_m_s, "position": other.position_m - tuned.position_m}
    assert np.abs(found[knob.of]).max() > knob.least


def test_every_tuned_setting_is_in_the_list(engine: Adapter) -> None:
    """Each setting of a tuned profile, except the step, is in `KNOBS`, and no other one is."""
    claimed = set(engine.profiles["tuned"].settings(1 / 60)) - {"dt_s"}
    assert claimed == {knob.name for knob in KNOBS if knob.engine == engine.name}
