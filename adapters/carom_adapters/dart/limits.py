"""Limits of DART: names of its settings, and supported scenes."""

from __future__ import annotations

from collections.abc import Mapping

from carom.engines.api import Capabilities, Scene, Setting, require_sound, require_supported

#: ``collision_detector`` is one of `DETECTORS`. ``split_impulse`` is an option of the constraint solver.
SETTINGS = ("collision_detector", "split_impulse")

#: Members of `CollisionDetectorType`.
DETECTORS = ("FCL", "DART", "BULLET", "ODE")

#: DART_MAX_BOUNCING_VELOCITY, compiled in: the greatest speed after a bounce.
FASTEST_BOUNCE_M_S = 100.0

#: DART_CFM, compiled in. DART enlarges the diagonal of the contact problem by the fraction `MIXING`, which reduces
#: impulses by the same fraction.
MIXING = 1e-5

CAPABILITIES = Capabilities(
    gravity=True,
    restitution=(0.0, 1.0),
    # DART multiplies the restitutions of two bodies. DART replaces a body's restitution above 1 by 0. So the
    # restitution of a disc and a wall is at most the disc's own coefficient.
    restitution_combine="product",
    # DART_BOUNCING_VELOCITY_THRESHOLD, compiled in. DART makes contacts with a closing speed of at most 0.1 m/s
    # inelastic.
    restitution_threshold_m_s=0.1,
    max_speed_m_s=FASTEST_BOUNCE_M_S,
    dimensions=3,
)


def check_inputs(scene: Scene, settings: Mapping[str, Setting]) -> None:
    """Check that DART supports a scene and settings.

    Raises:
        AdapterError: A number is invalid, or the scene needs more than DART supports.
    """
    require_sound("DART", scene, settings, SETTINGS, words={"collision_detector": DETECTORS})
    require_supported("DART", scene, CAPABILITIES, float(settings["dt_s"]))
