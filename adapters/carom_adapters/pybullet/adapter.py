"""Adapter of PyBullet (Bullet 3), an impulse-based 3D engine with 64-bit floats. Discs are spheres in one plane."""

from __future__ import annotations

from dataclasses import replace

from carom.engines.api import Accuracy, Knob, Profile
from carom_adapters.pybullet.limits import (
    CAPABILITIES,
    SHIPPED_RESTITUTION_THRESHOLD_M_S,
    SHIPPED_SPEED_CLAMP_M_S,
    SHIPPED_SPIN_CLAMP_RAD_S,
)
from carom_adapters.pybullet.settings_code import write_code
from carom_adapters.pybullet.world import PybulletWorld
from carom_adapters.shared import engine_adapter as shared

#: Bullet's contact points and normals of cylinders are slightly wrong. The velocities of cylinders in a row have errors
#: of up to 2.4e-4 times the greatest velocity (for a cradle with gaps, at 240 steps per second).
CYLINDER_ACCURACY = Accuracy(velocity=1e-3)

#: PyBullet damps bodies by default: both damping settings are 0.04, which reduces a spin of 10 rad/s by 3 rad/s in a
#: second.
_DEFAULT: shared.Settings = {"linearDamping": 0.0, "angularDamping": 0.0}

_TUNED: shared.Settings = {
    "linearDamping": 0.0,
    # By default a body is a multibody. A multibody has a speed of at most 100 m/s and a spin of at most 100 rad/s, and
    # no continuous detection. Bodies with maximal coordinates have no such limits, and their spin is not damped.
    "useMaximalCoordinates": True,
    # Bullet adds erp * depth / dt to the speed after a bounce. The default of erp is 0.08.
    "contactERP": 0.0,
    # Contacts are solved only while bodies overlap. By default Bullet solves contacts from a distance of 0.02 m on.
    "contactProcessingThreshold": 0.0,
    "contactSlop": 0.0,
    # Bullet makes contacts inelastic if their closing speed is below restitutionVelocityThreshold. The default of this
    # threshold is 0.2 m/s.
    "restitutionVelocityThreshold": 0.0,
    # By default, the order in which contacts of the same body are solved depends on memory addresses.
    "deterministicOverlappingPairs": 1,
    # By default, the solver stops when the residual is small, so that contacts of the same body lose energy.
    "solverResidualThreshold": 0.0,
    "numSolverIterations": 50,
    # For continuous detection, Bullet sweeps a sphere along the path of a step; `ccd_radius_fraction` is the radius of
    # this sphere divided by the disc's radius. Only discs whose initial velocity moves them by more than their radius
    # in a step are swept. If discs made fast by an impact were swept, they would be moved into bodies that they already
    # touch, and would gain energy. In Galperin's billiard at 60 steps per second, the energy would grow by a factor of
    # eight. With a fraction of 1, a swept disc would stop before it overlaps the other body, so that no contact is
    # found.
    "ccd_radius_fraction": 0.95,
}

_NO_CCD: shared.Settings = {**_TUNED, "ccd_radius_fraction": 0.0}

#: Cylinders touch along a line, but Bullet uses only single points of this line, which are not in the middle. So
#: cylinders tip over if they can turn.
_CYLINDER: shared.Settings = {**_TUNED, "shape": "cylinder", "turn": False}

_PLAIN_CYLINDER: shared.Settings = {**_TUNED, "shape": "cylinder", "turn": True}


adapter = shared.EngineAdapter(
    name="pybullet",
    engine=shared.build_engine("PyBullet", "pybullet", "pybullet", no_wheel_from=(3, 12), newest_tried="3.2.7"),
    capabilities=CAPABILITIES,
    knobs={
        "numSolverIterations": Knob(1, 200, log=True),
        "solverResidualThreshold": Knob(choices=(0.0, 1e-7)),
        "restitutionVelocityThreshold": Knob(0.0, 1.0),
        "contactERP": Knob(0.0, 1.0),
        "contactSlop": Knob(0.0, 1e-3),
        "contactProcessingThreshold": Knob(0.0, 0.02),
        "deterministicOverlappingPairs": Knob(choices=(0, 1)),
        "useMaximalCoordinates": Knob(choices=(False, True)),
        "ccd_radius_fraction": Knob(0.0, 0.95),
    },
    profiles={
        "default": Profile(
            "PyBullet's defaults (which limit speeds to 100 m/s and spins to 100 rad/s), but without damping and with "
            "the scene's restitution and friction.",
            shared.add_step(_DEFAULT),
            capabilities=replace(
                CAPABILITIES,
                continuous_detection=False,
                max_speed_m_s=SHIPPED_SPEED_CLAMP_M_S,
                max_spin_rad_s=SHIPPED_SPIN_CLAMP_RAD_S,
                restitution_threshold_m_s=SHIPPED_RESTITUTION_THRESHOLD_M_S,
            ),
            changed={
                "restitution": shared.OF_THE_SCENE,
                "lateralFriction": shared.OF_THE_SCENE,
                "linearDamping": "no damping, because scenes have no air",
                "angularDamping": "no damping, because scenes have no air",
            },
        ),
        "tuned": shared.build_tuned_profile(
            "contacts act only when bodies overlap, overlapping bodies are never pushed apart, and fast discs have "
            "continuous detection",
            _TUNED,
        ),
        # Bullet stops a swept disc inside the other disc. So if discs were swept, bisection could not find the impact.
        "located": shared.build_located_profile(
            "Bullet's own collision detection", _NO_CCD, but=" without continuous detection"
        ),
        "no-ccd": Profile("The tuned settings without continuous detection.", shared.add_step(_NO_CCD)),
        "cylinder": Profile(
            "The tuned settings with cylinders instead of spheres. Infinite moments of inertia keep the "
            "cylinders from tipping over (Carom's own measurements).",
            shared.add_step(_CYLINDER),
            CYLINDER_ACCURACY,
        ),
        "cylinder-plain": Profile(
            "The tuned settings with cylinders instead of spheres. The cylinders can turn, so they tip over.",
            shared.add_step(_PLAIN_CYLINDER),
        ),
    },
    world=PybulletWorld,
    code=write_code,
)
