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

#: Bullet's contact points and normals of cylinders are slightly off. The velocities of cylinders in a row are wrong by
#: up to 2.4e-4 of the greatest velocity (for a cradle with gaps, at 240 steps a second).
CYLINDER_ACCURACY = Accuracy(velocity=1e-3)

#: Both dampings are 0.04 by default, which takes 3 rad/s from a spin of 10 rad/s in a second.
_DEFAULT: shared.Settings = {"linearDamping": 0.0, "angularDamping": 0.0}

_TUNED: shared.Settings = {
    "linearDamping": 0.0,
    # A multibody, the default, clamps its speed at 100 m/s and its spin at 100 rad/s, and ignores continuous
    # detection. Maximal coordinates do not damp spin.
    "useMaximalCoordinates": True,
    # Bullet adds erp * depth / dt to the bounce (0.08 is the default).
    "contactERP": 0.0,
    # Contacts are solved only while bodies overlap. By default Bullet solves them from a distance of 0.02 m on.
    "contactProcessingThreshold": 0.0,
    "contactSlop": 0.0,
    # Slower contacts than this are made inelastic (0.2 m/s is the default).
    "restitutionVelocityThreshold": 0.0,
    # Shared contacts are solved in an order that does not depend on addresses.
    "deterministicOverlappingPairs": 1,
    # All iterations are done, even if the residual is small. Otherwise shared contacts lose energy.
    "solverResidualThreshold": 0.0,
    "numSolverIterations": 50,
    # A disc that moves by more than its radius in a step at the start may otherwise pass through another disc. Slow
    # discs are not swept. If an impact made such a disc fast, the disc would be swept into walls and neighbours
    # that it already touches, and gain energy (eightfold in Galperin's billiard at 60 steps a second). If the swept
    # sphere were as large as the disc, it would stop the disc before an overlap, and the contact would be lost.
    "ccd_radius_fraction": 0.95,
}

_NO_CCD: shared.Settings = {**_TUNED, "ccd_radius_fraction": 0.0}

#: Cylinders touch along a line, but Bullet keeps only single points of this line, away from its middle. Cylinders
#: that can turn tip over.
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
            "PyBullet's defaults (with a clamp of 100 m/s and rad/s), but undamped and with the scene's restitution "
            "and friction.",
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
            "only overlaps are solved, and never pushed apart, and fast discs are swept", _TUNED
        ),
        # Bullet itself stops a swept disc inside the other disc. So there is no instant of an impact to find.
        "located": shared.build_located_profile("Bullet's own collision detection", _NO_CCD, but=" without sweeping"),
        "no-ccd": Profile(
            "The tuned settings without continuous detection: no disc is swept.", shared.add_step(_NO_CCD)
        ),
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
