"""Every setting that a tuned profile claims matters does reach its engine: put back, it changes what happens."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
import pytest
from tests.adapters.engine_scenes import (
    build_break_scene,
    build_cradle_scene,
    build_floor_scene,
    build_oblique_scene,
    scale_tolerance,
)
from tests.cases import each
from tests.scene_builders import Finish, Named

from carom import Disc, Scene
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
            try:
                found = world.settings[name]
                same = found == value or math.isclose(
                    float(found), float(value), rel_tol=scale_tolerance(engine, 2.0**-52)
                )
                assert same, (name, value, found)
            finally:
                world.close()


def _fine_scene() -> Scene:
    return build_oblique_scene().model_copy(update={"frame_rate_hz": 240.0})


def _coarse_scene() -> Scene:
    return build_oblique_scene().model_copy(update={"frame_rate_hz": 16.0})


def _rough_scene() -> Scene:
    return build_oblique_scene().model_copy(update={"frame_rate_hz": 240.0, "friction": 0.1, "wall_friction": 0.1})


def _slow_scene() -> Scene:
    """At 4 cm/s, below the speeds under which engines ship contacts inelastic."""
    return build_oblique_scene(time=100.0).model_copy(update={"frame_rate_hz": 2.4})


def _bullet_scene() -> Scene:
    """A disc that is 33 radii on after a step, and meets another on the way."""
    discs = [
        Disc(position_m=(-8.9, 0), velocity_m_s=(100, 0), radius_m=0.05),
        Disc(position_m=(0, 0.06), radius_m=0.05, mass_kg=2),
    ]
    return Scene(name="bullet", discs=discs, duration_s=0.2, frame_rate_hz=60.0)


def _fast_scene() -> Scene:
    return Scene(name="fast", discs=[Disc(position_m=(0, 0), velocity_m_s=(200, 0), radius_m=1)], duration_s=0.1)


def _far_scene() -> Scene:
    return Scene(name="far", discs=[Disc(position_m=(9.99e9, 0), velocity_m_s=(1e9, 0), radius_m=1)], duration_s=0.1)


def _inelastic_scene() -> Scene:
    return catalogue()["classics/perfectly-inelastic"].scene


def _shared_contact_scene() -> Scene:
    return build_cradle_scene().model_copy(update={"frame_rate_hz": 240.0})


def _break_scene() -> Scene:
    return build_break_scene().model_copy(update={"frame_rate_hz": 240.0})


def _seams_scene() -> Scene:
    """The start of sixteen at which pymunk's segments, each on its own, turn the disc aside most."""
    return build_floor_scene(10, 11 / 16)


def _slow_seams_scene() -> Scene:
    """The start of sixteen at which tuned Box2D turns the disc aside at half a metre a second, if edges stand alone."""
    return build_floor_scene(10, 10 / 16, 0.5)


@dataclass(frozen=True)
class Knob:
    """A tuned setting put back to what is shipped (or worse), where that shows, and the least that it does there."""

    engine: str
    name: str
    value: Setting
    scene: Callable[[], Scene]
    least: float
    of: str = "velocity"

    def __str__(self) -> str:
        return f"{self.engine} {self.name}={self.value}"


#: The least effects are a tenth of what was measured, in metres per second or metres; all are far above rounding,
#: except for an order of solving, and for MuJoCo's tolerance.
KNOBS = [
    Knob("pymunk", "iterations", 10, _break_scene, 1e-7),
    Knob("pymunk", "collision_bias", 0.0018, _coarse_scene, 1e-2, of="position"),
    Knob("pymunk", "set_neighbors", 0, _seams_scene, 1e-1),
    Knob("pybullet", "linearDamping", 0.04, _fine_scene, 1e-2),
    Knob("pybullet", "useMaximalCoordinates", False, _fast_scene, 1e1),
    Knob("pybullet", "contactERP", 0.08, _fine_scene, 1e-2),
    Knob("pybullet", "contactProcessingThreshold", 1e18, _fine_scene, 1e-1),
    Knob("pybullet", "contactSlop", 1e-5, _shared_contact_scene, 1e-4),
    Knob("pybullet", "restitutionVelocityThreshold", 0.2, _slow_scene, 1e-3),
    Knob("pybullet", "deterministicOverlappingPairs", 0, _shared_contact_scene, 1e-12),
    Knob("pybullet", "solverResidualThreshold", 1e-7, _shared_contact_scene, 1e-5),
    Knob("pybullet", "numSolverIterations", 10, _shared_contact_scene, 1e-3),
    Knob("pybullet", "ccd_radius_fraction", 0.0, _bullet_scene, 1e1),
    Knob("mujoco", "joints", "free", _bullet_scene, 1e1),
    Knob("mujoco", "stiffness", 1000.0, _fine_scene, 1e-2),
    Knob("mujoco", "in_turn", False, _rough_scene, 1e-2),
    Knob("mujoco", "solimp", "0.9 0.95 0.001 0.5 2", _break_scene, 1e-2),
    Knob("mujoco", "integrator", "RK4", _fine_scene, 1e-1),
    Knob("mujoco", "integrator", "discrete", _fine_scene, 1e-1),
    Knob("mujoco", "jacobian", "sparse", _break_scene, 1e-1),
    Knob("mujoco", "tolerance", 1e-8, _fine_scene, 1e-13),
    Knob("mujoco", "autoreset", True, _far_scene, 1e-1),
    Knob("mujoco", "speculative", False, _bullet_scene, 1e1),
    Knob("box2d", "velocity_scale", 1.0, _slow_scene, 1e-3),
    Knob("box2d", "velocityIterations", 8, _shared_contact_scene, 1e-3),
    Knob("box2d", "positionIterations", 3, _inelastic_scene, 1e-3, of="position"),
    Knob("box2d", "sweep", "none", _bullet_scene, 1e1),
    Knob("box2d", "chains", False, _slow_seams_scene, 1.0),
    Knob("box2d", "polygon_radius_m", 0.01, _fine_scene, 1e-3, of="position"),
]


@each("knob", KNOBS)
def test_tuned_settings_have_an_effect(named: Named, finish: Finish, knob: Knob) -> None:
    """Resetting a tuned setting to its default changes the run by at least the listed amount."""
    adapter, scene = named(knob.engine), knob.scene()
    dt_s = 1 / scene.frame_rate_hz
    tuned, other = (finish(adapter, scene, dt_s, **changes) for changes in ({}, {knob.name: knob.value}))
    found = {"velocity": other.velocity_m_s - tuned.velocity_m_s, "position": other.position_m - tuned.position_m}
    assert np.abs(found[knob.of]).max() > knob.least


def test_every_tuned_setting_is_in_the_list(engine: Adapter) -> None:
    """Each setting of a tuned profile, except the step, is in `KNOBS`, and no other one is."""
    claimed = set(engine.profiles["tuned"].settings(1 / 60)) - {"dt_s"}
    assert claimed == {knob.name for knob in KNOBS if knob.engine == engine.name}


@pytest.mark.long
@each(
    "name, profile, changes",
    [
        ("pybullet", "tuned", {"warmStartingFactor": 0.85}),
        ("pybullet", "tuned", {"angularDamping": 0.04}),
        ("mujoco", "tuned", {"warmstart": True}),
        ("box2d", "tuned", {"warmStarting": False}),
        ("box2d", "tuned", {"sleepingAllowed": False}),
    ],
)
def test_omitted_settings_have_no_effect(
    named: Named, finish: Finish, name: str, profile: str, changes: dict[str, Setting]
) -> None:
    """Settings that others recommend, but no profile sets, change velocities by rounding only."""
    adapter = named(name)
    for scene in (build_oblique_scene(), _shared_contact_scene(), _inelastic_scene(), _slow_scene()):
        dt_s = 1 / scene.frame_rate_hz
        kept, changed = finish(adapter, scene, dt_s, profile), finish(adapter, scene, dt_s, profile, **changes)
        # A few units of rounding at 4 m/s.
        np.testing.assert_allclose(
            changed.velocity_m_s, kept.velocity_m_s, rtol=0, atol=scale_tolerance(adapter, 4 * float(np.spacing(4.0)))
        )


@each(
    "name, scene, shipped",
    [
        ("pymunk", build_break_scene(), {"iterations": 10}),
        ("pybullet", build_cradle_scene(), {"solverResidualThreshold": 1e-7}),
    ],
)
def test_tuned_iterations_conserve_energy_in_shared_contacts(
    named: Named, finish: Finish, name: str, scene: Scene, shipped: dict[str, Setting]
) -> None:
    """With shared contacts the tuned iterations conserve kinetic energy 100 times better than the default ones."""
    adapter, dt_s = named(name), 1 / 240
    start = sum(disc.velocity_m_s[0] ** 2 for disc in scene.discs)  # all masses are 1 kg, and only one disc moves
    tuned, less = (
        abs(float((finish(adapter, scene, dt_s, **changes).velocity_m_s ** 2).sum()) / start - 1)
        for changes in ({}, shipped)
    )
    assert tuned * 100 < less
