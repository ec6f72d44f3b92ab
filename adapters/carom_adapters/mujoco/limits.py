"""Limits of MuJoCo: names of its settings, supported scenes, and input checks."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace

from carom.engines.api import AdapterError, Scene, Setting, require_sound, require_supported
from carom_adapters.shared.engine_adapter import GENERAL

#: Attributes of MJCF's ``option``, and of its child ``flag``, with MuJoCo's names.
OPTION_SETTINGS = (
    "integrator",
    "jacobian",
    "tolerance",
    "iterations",
    "ccd_tolerance",
    "ccd_iterations",
    "cone",
    "solver",
)
FLAG_SETTINGS = ("warmstart", "autoreset", "speculative")

#: Names that MJCF has for the members of `mujoco.mjtIntegrator`.
MJCF_INTEGRATORS = {
    "mjINT_EULER": "Euler",
    "mjINT_RK4": "RK4",
    "mjINT_IMPLICIT": "implicit",
    "mjINT_IMPLICITFAST": "implicitfast",
    "mjINT_DISCRETE": "discrete",
}

#: ``joints`` determines how discs can move. The value "free" allows all motions. The value "slide" allows motion along
#: x and y, and, if discs turn, also along z and about a hinge. ``stiffness`` (1/s^2) is the stiffness of a contact,
#: where 0 means no spring; see `_compute_solref` of `model`. ``solimp`` is an attribute of a geom. With
#: ``listed_pairs`` each pair of bodies is listed in the model, and is tested in every step. ``shape`` is "sphere" or
#: "cylinder". A cylinder is as high as it is wide. With ``in_turn``, contacts with friction are solved one after
#: another. In each contact the normal force comes first, and then friction within the bounds that the normal force
#: sets. Without ``in_turn`` MuJoCo solves all contacts together, as an optimisation problem.
OTHER_SETTINGS = ("joints", "stiffness", "solimp", "listed_pairs", "shape", "in_turn")

#: Possible values of settings that are words.
WORDS: Mapping[str, tuple[str, ...]] = {
    "integrator": tuple(MJCF_INTEGRATORS.values()),
    "jacobian": ("dense", "sparse", "auto"),
    "joints": ("free", "slide"),
    "shape": ("sphere", "cylinder"),
    "cone": ("pyramidal", "elliptic"),
    "solver": ("PGS", "CG", "Newton"),
}

#: MuJoCo's mjMAXVAL. A coordinate, velocity or acceleration above mjMAXVAL is an error in MuJoCo.
LARGEST_VALUE = 1e10

#: Smallest acceleration of an impact that the adapter accepts. MuJoCo's solver ignores accelerations below mjMINVAL,
#: 1e-15.
LEAST_ACCELERATION_M_S2 = 1e-12

#: Largest number of discs in a scene whose pairs the model lists. 1000 discs have half a million pairs, which MuJoCo
#: compiles in seconds.
MOST_LISTED = 1000

CAPABILITIES = replace(
    GENERAL,
    damping=True,
    spin=True,
    # Because of rounding, a contact point is not exactly on the line of centres. So the normal impulse also changes the
    # spin. The error of the spin grows as the inertia decreases. With the inertia factor 1e-5, the relative error of
    # the spin is 5e-9 for discs at a distance of 200 radii from the origin. MuJoCo itself refuses an inertia below
    # mjMINVAL, 1e-15 in units of the model.
    min_inertia_factor=1e-5,
    # The smallest coefficient of friction is mjMINMU: MuJoCo silently replaces smaller coefficients, except 0, by
    # mjMINMU. From a coefficient of 1e80 on, MuJoCo applies no friction, since the coefficient's fourth power
    # overflows.
    friction=(1e-5, 1e30),
    continuous_detection=True,
    max_speed_m_s=LARGEST_VALUE,
    max_coordinate_m=LARGEST_VALUE,
    # MuJoCo's mjMINVAL is 1e-15. MuJoCo refuses a body whose mass is below mjMINVAL. If the distance of two centres is
    # below mjMINVAL, MuJoCo uses an arbitrary normal. The smallest radius is far above mjMINVAL.
    min_radius_m=1e-12,
    min_mass_kg=math.nextafter(1e-15, 1.0),
    # A contact's regularisation, (1 - d) / d / mass with the impedance d = 0.9999, must be at least mjMINVAL.
    max_mass_kg=1e11,
    dimensions=3,
)


def does_solve_in_turn(scene: Scene, settings: Mapping[str, Setting]) -> bool:
    """Whether contacts are solved one after another, which needs friction and the setting ``in_turn``."""
    return bool(settings.get("in_turn", False)) and scene.arrays.has_friction


def does_list_pairs(scene: Scene, settings: Mapping[str, Setting]) -> bool:
    """Whether the model lists each pair of bodies: with `listed_pairs`, or with `in_turn` and friction."""
    return bool(settings.get("listed_pairs", False)) or does_solve_in_turn(scene, settings)


def require_usable(scene: Scene, settings: Mapping[str, Setting]) -> None:
    """Refuse scenes that are not supported, and input that MuJoCo rejects or for which MuJoCo would fail silently.

    Raises:
        AdapterError: The scene or a setting is not supported, or a number is beyond a limit of MuJoCo.
    """
    known = (*OPTION_SETTINGS, *FLAG_SETTINGS, *OTHER_SETTINGS)
    require_sound("MuJoCo", scene, settings, known, {"tolerance": 0.0, "iterations": 1, "stiffness": 0.0}, words=WORDS)
    if scene.damping_per_s > LARGEST_VALUE:
        raise AdapterError(f"MuJoCo: damping_per_s must be at most {LARGEST_VALUE:g}, got {scene.damping_per_s:g}")
    if does_list_pairs(scene, settings) and len(scene.discs) > MOST_LISTED:
        why = "listed_pairs" if settings.get("listed_pairs", False) else "in_turn with friction, which lists all pairs,"
        raise AdapterError(f"MuJoCo: {why} supports at most {MOST_LISTED} discs, got {len(scene.discs)}")
    dt_s = float(settings["dt_s"])
    fastest = max(math.hypot(*disc.velocity_m_s) for disc in scene.discs)
    if 0 < fastest < LEAST_ACCELERATION_M_S2 * dt_s:
        raise AdapterError(
            f"MuJoCo: the fastest disc's speed divided by dt_s must be at least {LEAST_ACCELERATION_M_S2:g} m/s^2, "
            f"got {fastest:g} m/s and {dt_s:g} s; MuJoCo's solver would treat a slower bounce as a rounding error"
        )
    require_supported("MuJoCo", scene, CAPABILITIES, dt_s)
