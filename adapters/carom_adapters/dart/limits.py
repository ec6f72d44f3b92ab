"""What DART can take: its settings by name, its limits, and the refusal of what is beyond them."""

from __future__ import annotations

from collections.abc import Mapping

from carom.adapter import AdapterError, Capabilities, ContactTimes, Scene, Setting, require_sound

__all__ = ["CAPABILITIES", "DETECTORS", "FASTEST_BOUNCE_M_S", "MIXING", "require_usable"]

#: ``collision_detector`` is one of `DETECTORS`; ``split_impulse`` is an option of the constraint solver.
SETTINGS = ("collision_detector", "split_impulse")

#: Members of `CollisionDetectorType`.
DETECTORS = ("FCL", "DART", "BULLET", "ODE")

#: DART_MAX_BOUNCING_VELOCITY, compiled in: no contact gives more back than this.
FASTEST_BOUNCE_M_S = 100.0

#: DART_BOUNCING_VELOCITY_THRESHOLD, compiled in: contacts that close at no more than this are made inelastic.
THRESHOLD_M_S = 0.1

#: DART_CFM, compiled in: the diagonal of the contact problem is made larger by this part, and an impulse smaller.
MIXING = 1e-5

CAPABILITIES = Capabilities(
    gravity=True,
    restitution=(0.0, 1.0),
    # Of a body whose coefficient is above 1 DART makes it 0, so that walls can't have what the discs' lack.
    restitution_combine="product",
    restitution_threshold_m_s=THRESHOLD_M_S,
    contact_times=ContactTimes.STEP,
    max_speed_m_s=FASTEST_BOUNCE_M_S,
    dimensions=3,
)


def require_usable(scene: Scene, settings: Mapping[str, Setting]) -> None:
    """Refuse what DART would silently get wrong.

    Raises:
        AdapterError: A setting has an unknown name or value.
    """
    require_sound("DART", scene, settings, SETTINGS)
    detector = settings["collision_detector"]
    if detector not in DETECTORS:
        raise AdapterError(f"DART: collision_detector must be one of {', '.join(DETECTORS)}, got {detector!r}")
