"""Bug reports about impacts of discs: tunnelling, lost restitution, and contact at the start."""

from __future__ import annotations

import math

from carom.catalogue.closed_forms import compute_after_impact
from carom.catalogue.entry import KnownAnswer, Staged
from carom.catalogue.staging import build_disc, build_impact, build_scene, build_staged, stage_meeting, stage_struck_row

_NEWTON = "Conservation of momentum and Newton's law of restitution, for a head-on impact"

_CONVENTION = (
    "Touching discs collide at one instant; impacts are applied to one pair at a time, as if there were tiny gaps"
)


def head_on(
    *,
    speeds: tuple[float, float],
    radius_m: tuple[float, float],
    gap_m: float,
    duration_s: float,
    rate_hz: float = 60.0,
    mass_kg: tuple[float, float] = (1.0, 1.0),
    restitution: float = 1.0,
) -> Staged:
    """Build a scene in which two discs meet head-on. The first disc starts at the origin and moves to the right."""
    (v0, v1), (r0, r1), (m0, m1) = speeds, radius_m, mass_kg
    discs = [build_disc(0, v0, r0, m0), build_disc(r0 + r1 + gap_m, v1, r1, m1)]
    scene = build_scene(discs, restitution=restitution, duration_s=duration_s, frame_rate_hz=rate_hz)
    after = compute_after_impact(m0, v0, m1, v1, 1, restitution)
    return build_staged(scene, [build_impact(gap_m / (v0 - v1), 0, 1, *after)], _NEWTON)


def mujoco_441() -> Staged:
    """A small ball moves towards a thin wall. In each step the ball moves by three times its diameter."""
    return head_on(
        speeds=(60.0, 0.0), radius_m=(0.02, 0.01), gap_m=0.97, mass_kg=(1.0, math.inf), duration_s=0.03, rate_hz=500.0
    )


def bullet3_2228() -> Staged:
    """A disc at 500 m/s meets an immovable disc."""
    # An impulse of 500 N s gives a mass of 1 kg this speed.
    return head_on(speeds=(500.0, 0.0), radius_m=(0.5, 0.5), gap_m=9.3, mass_kg=(1.0, math.inf), duration_s=0.1)


def hardspheredynamics_8() -> Staged:
    """A disc meets a disc of infinite mass."""
    return head_on(speeds=(1.5, 0.0), radius_m=(0.2, 0.3), gap_m=0.4, mass_kg=(1.0, math.inf), duration_s=1.0)


def newton_3233() -> Staged:
    """A disc strikes the first of two touching discs."""
    return stage_struck_row([0.5, 0.0], _CONVENTION, radius_m=0.0625, speed=2.0, duration_s=0.5, frame_rate_hz=240.0)


def pooltool_257() -> Staged:
    """A row of four discs with gaps of a nanometre is struck at one end."""
    return stage_struck_row([0.3] + [2.0**-30] * 3, radius_m=0.03125, speed=1.5, duration_s=0.5, frame_rate_hz=240.0)


def pooltool_354() -> Staged:
    """Two pairs of discs touch. One pair moves at the same velocity, and the other separates: there is no impact."""
    places, velocities = (0, 0.5, 0 - 3j, 0.5 - 3j), (1 + 0.5j, 1 + 0.5j, -1, 0.5)
    discs = [build_disc(place, velocity, 0.25) for place, velocity in zip(places, velocities, strict=True)]
    scene = build_scene(discs, duration_s=1.0)
    return build_staged(scene, [], "Bodies that touch but do not approach exchange no impulse")


def visualchemeng_10() -> Staged:
    """Two discs that overlap by one rounding error at the start approach each other."""
    # In floats, .3 - .1 is a little less than .2, so the two bodies overlap by one rounding error.
    discs = [build_disc(0.1, 1, 0.1), build_disc(0.3, -1, 0.1), build_disc(0.3 + 0.5j, 0, 0.1)]
    impacts, source = [build_impact(0.0, 0, 1, -1, 1)], "Equal masses exchange velocities, here at the start"
    return build_staged(build_scene(discs, duration_s=0.5), impacts, source)


def dynamo_57() -> Staged:
    """Three discs in a line with restitution 1/16 have infinitely many impacts in a finite time."""
    radius = 0.25
    discs = [build_disc(-0.75, 1, radius), build_disc(0, 0, radius), build_disc(0.75, -1, radius)]
    scene = build_scene(discs, restitution=0.0625, duration_s=2.0)
    source = (
        "Below a restitution of 7 - 4 sqrt(3), three equal discs in a line collide infinitely often and stay "
        "together, with their centre of mass at rest (S. McNamara and W. R. Young, Phys. Fluids A 4, 496, 1992)"
    )
    convention = (
        "Both outer discs hit the middle disc at one instant; in either order of these two impacts, all discs end at "
        "rest"
    )
    return Staged(scene, KnownAnswer(source, final_velocity_m_s=((0.0, 0.0),) * 3, convention=convention))


def cannon_359() -> Staged:
    """Two balls without friction collide off centre, and lose no energy."""
    return stage_meeting((3, -2 + 0.5j), (0.5, 0.5), offset=0.4, time_s=0.51, duration_s=1.25)
