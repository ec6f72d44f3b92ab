"""Attacks with one pair of discs, which vary a length, a speed, a mass or the offset of the meeting."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

from carom.catalogue.closed_forms import disc
from carom.model.scene import Disc, Scene
from carom.studies.stress.attack import Attack, Trial, velocity_judge
from carom.studies.stress.true_motion import true_motion
from carom.support.formatting import number

RATE_HZ = 240.0

#: Phases of the impact. A method can be lucky at one phase, so each value is tried at several phases.
PHASES = (0.13, 0.52, 0.89)

#: Numbers of steps before and after the impact. A contact modelled by a spring lasts several steps: 24 steps at
#: MuJoCo's usual stiffness of 1000 /s².
STEPS_BEFORE, STEPS_AFTER = 4, 40
MEETING_S = (STEPS_BEFORE + STEPS_AFTER) * (1.0 / RATE_HZ)

_RADIUS_M = 0.25

#: Default speed: a hundredth of a diameter per step, which every method should handle.
_SPEED_M_S = 0.01 * 2 * _RADIUS_M * RATE_HZ

_TRUTH = "the quadratic for two discs on straight lines, solved with 240 decimal digits from the stored scene"
_VELOCITY = (
    "a final velocity is wrong by more than a tenth of the change by the impact; a miss is wrong by the whole change"
)


def attacked(name: str, shows: str, discs: Sequence[Disc], duration_s: float = MEETING_S, **fields: Any) -> Scene:
    """Return a scene of an attack (default duration: the duration of a meeting)."""
    rates = {"frame_rate_hz": RATE_HZ}
    return Scene(name=f"stress/{name}", description=shows, discs=discs, duration_s=duration_s, **rates | fields)


def _meeting(
    name: str,
    shows: str,
    phase: float,
    *,
    speed: float = _SPEED_M_S,
    radius: float = _RADIUS_M,
    offset: float = 0.0,
    mass: float = 1.0,
    origin: float = 0.0,
) -> Trial:
    """Make a trial of a disc from the left that meets an equally large disc at rest."""
    dt = 1.0 / RATE_HZ
    contact = 2 * radius
    across = offset * contact
    along = math.sqrt(max(contact * contact - across * across, 0.0)) + speed * dt * (STEPS_BEFORE + phase)
    striker = disc(complex(origin - along, origin), complex(speed), radius)
    scene = attacked(name, shows, [striker, disc(complex(origin, origin + across), 0j, radius, mass)])
    return Trial(scene, velocity_judge(true_motion(scene), scene))


def _attack(
    name: str,
    axis: str,
    ends: tuple[float, float],
    shows: str,
    *,
    truth: str = _TRUTH,
    gives_way: str = _VELOCITY,
    **of: Callable[[float], float],
) -> Attack:
    """Return an attack on a meeting at every phase.

    The keywords are functions from the attack's value to the arguments of `_meeting`.
    """

    def trials(value: float) -> Sequence[Trial]:
        sizes = {key: function(value) for key, function in of.items()}
        met = shows.format(value=number(value, 3))
        return [_meeting(name, f"{met} Phase {phase:g} of a step.", phase, **sizes) for phase in PHASES]

    return Attack(name, axis, *ends, trials, truth, gives_way)


def _of_size(name: str, absurd: float) -> Attack:
    """Return the attack that shrinks or enlarges the whole scene."""
    return _attack(
        name,
        "radius in metres, which scales the whole scene",
        (1.0, absurd),
        "Discs of radius {value} m meet head-on at a fiftieth of the radius per step.",
        gives_way=f"{_VELOCITY}; only the unit of length changes, so an absolute length or speed causes a failure",
        radius=lambda value: value,
        speed=lambda value: 0.02 * value * RATE_HZ,
    )


def pair_attacks() -> list[Attack]:
    """Return the attacks with one pair of discs."""
    return [
        _attack(
            "grazing",
            "1 - b/R, the relative distance from a miss",
            (0.1, 1e-15),
            "A disc grazes another, where 1 - b/R is {value}.",
            offset=lambda value: 1.0 - value,
        ),
        _attack(
            "mass-ratio",
            "mass of the struck disc over that of the striker",
            (1.0, 1e12),
            "A disc of 1 kg meets one of {value} kg head-on.",
            gives_way=f"{_VELOCITY}; the heavy disc's small change counts as much as the light one's",
            mass=lambda value: value,
        ),
        _attack(
            "tunnelling",
            "path per step over radius",
            (0.01, 1e4),
            "A disc that moves {value} radii per step meets one at rest head-on.",
            speed=lambda value: value * _RADIUS_M * RATE_HZ,
        ),
        _of_size("small", 1e-6),
        _of_size("large", 1e6),
        _attack(
            "far-away",
            "distance from the origin in metres, in x and in y",
            (1.0, 1e12),
            "Two discs meet head-on {value} m from the origin.",
            truth=f"{_TRUTH}, with positions rounded at that distance",
            origin=lambda value: value,
        ),
        _attack(
            "slow",
            "approach speed in m/s, at a fixed step",
            (10.0, 1e-9),
            "Two discs meet head-on at {value} m/s.",
            gives_way=f"{_VELOCITY}; engines with a restitution threshold fail",
            speed=lambda value: value,
        ),
    ]
