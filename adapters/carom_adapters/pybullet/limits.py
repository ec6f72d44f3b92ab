"""Limits of Bullet: names of its settings, supported scenes, and input checks."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from carom.engines.api import AdapterError, Scene, Setting, require_sound, require_supported
from carom_adapters.shared.engine_adapter import GENERAL

#: Arguments of `setPhysicsEngineParameter`, with PyBullet's names. ``contactBreakingThreshold`` is not included, since
#: this setting applies to the whole process and would affect later runs.
WORLD_SETTINGS = (
    "numSolverIterations",
    "solverResidualThreshold",
    "restitutionVelocityThreshold",
    "contactERP",
    "contactSlop",
    "warmStartingFactor",
    "deterministicOverlappingPairs",
)

#: Arguments of `changeDynamics` for every body, with PyBullet's names.
BODY_SETTINGS = ("linearDamping", "angularDamping", "contactProcessingThreshold")

#: Other settings. ``useMaximalCoordinates`` is an argument of `createMultiBody`. ``ccd_radius_fraction`` is
#: `ccdSweptSphereRadius` divided by the disc's radius, 0 for no sweep. ``shape`` is one of `SHAPES`. A cylinder is as
#: high as it is wide. With ``turn`` a disc has the moments of inertia of its shape. Without ``turn`` the moments are
#: infinite.
OTHER_SETTINGS = ("useMaximalCoordinates", "ccd_radius_fraction", "shape", "turn")
SHAPES = ("sphere", "cylinder")

#: Shortest step size. If a step size, 1/mass or a distance of discs is below 2.2e-16 (Bullet's constant SIMD_EPSILON),
#: Bullet ignores the step, treats the body as static, or uses an arbitrary normal.
SHORTEST_STEP_S = 1e-15

#: Smallest allowed values of settings. PyBullet silently ignores smaller values.
LEAST = dict.fromkeys((*WORLD_SETTINGS, *BODY_SETTINGS, "ccd_radius_fraction"), 0.0) | {
    "numSolverIterations": 1,
    "dt_s": SHORTEST_STEP_S,
}

#: Limits with PyBullet's default settings: the largest speed and the largest spin of a body (m_maxCoordinateVelocity),
#: and the closing speed below which contacts are inelastic (restitutionVelocityThreshold).
SHIPPED_SPEED_CLAMP_M_S = 100.0
SHIPPED_SPIN_CLAMP_RAD_S = 100.0
SHIPPED_RESTITUTION_THRESHOLD_M_S = 0.2

CAPABILITIES = replace(
    GENERAL,
    damping=True,
    rolling_resistance=True,
    spin=True,
    # Because of rounding, a contact point is not exactly on the line of centres. So the normal impulse also changes the
    # spin. The error of the spin grows as the inertia decreases. With the inertia factor 1e-6, the relative error of
    # the spin is 1e-8 for discs at a distance of 200 radii from the origin.
    min_inertia_factor=1e-6,
    # The largest friction is Bullet's MAX_FRICTION. Bullet reduces a larger product of two bodies' coefficients to
    # MAX_FRICTION (`btManifoldResult`).
    friction=(0.0, 10.0),
    continuous_detection=True,
    # A plane's bounding box ends at BT_LARGE_FLOAT = 1e18.
    max_coordinate_m=1e17,
    min_radius_m=1e-15,
    # Bullet removes a moving body from the simulation when the squared diagonal of its bounding box, 12 radius^2,
    # reaches 1e12 (`btCollisionWorld::updateSingleAabb`). The box is larger than the body by the contact margin.
    max_radius_m=2.8e5,
    # With smaller masses, a quotient of two masses could overflow 64-bit floats.
    min_mass_kg=1e-100,
    max_mass_kg=1e15,
    dimensions=3,
)


def require_usable(scene: Scene, settings: Mapping[str, Setting]) -> None:
    """Refuse input that Bullet does not support.

    Raises:
        AdapterError: The scene or a setting is not supported.
    """
    known = (*WORLD_SETTINGS, *BODY_SETTINGS, *OTHER_SETTINGS)
    require_sound("PyBullet", scene, settings, known, LEAST, words={"shape": SHAPES})
    require_supported("PyBullet", scene, CAPABILITIES, float(settings["dt_s"]))
    for name, bodies in (("discs", scene.discs), ("walls", scene.walls)):
        for i, body in enumerate(bodies):
            for velocity in (leg.velocity for leg in body.drive.legs if body.driven):
                if max(map(abs, velocity)) > SHIPPED_SPEED_CLAMP_M_S:
                    limit_text = f"{SHIPPED_SPEED_CLAMP_M_S:g} m/s"
                    raise AdapterError(
                        f"PyBullet: {name}[{i}] is driven at {velocity}; Bullet limits its components to {limit_text}"
                    )
    if scene.wall_rolling_resistance and len(radii := {d.radius_m for d in scene.discs if not d.immovable}) > 1:
        raise AdapterError(
            f"PyBullet: with wall_rolling_resistance, all movable discs must have the same radius, because a wall in "
            f"Bullet has one torque for all discs; the radii are {min(radii):g} to {max(radii):g} m"
        )
    for i, disc in enumerate(scene.discs):
        if disc.driven and disc.spin_rad_s and not disc.drive.is_stationary:
            raise AdapterError(
                f"PyBullet: discs[{i}] is driven and spins at {disc.spin_rad_s:g} rad/s; Bullet supports only one of "
                "the two, because a spin also rotates the velocity of a multibody"
            )
