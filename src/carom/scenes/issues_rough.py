"""Complaints about friction and spin at impacts: a ball that takes up no spin, a billiard ball thrown too little."""

from __future__ import annotations

from carom.scene import Disc
from carom.scenes.closed_forms import scene_of
from carom.scenes.complaint import complained
from carom.scenes.entry import KnownAnswer, KnownImpact, Staged
from carom.scenes.walled import FLOOR

#: When the impacts are, seconds.
_TIME_S = 0.25


@complained(
    package="MBSim",
    thread="https://github.com/mbsim-env/mbsim/issues/49",
    reported="A ball with friction bounces without taking up a spin, and begins to roll only when all bouncing is "
    "over; a ball that spins bounces without being driven aside.",
    at_least=0.1,
    made="The thread has a slope and gravity; here it is one bounce on a level floor. All sizes are ours.",
)
def _mbsim_49() -> Staged:
    """A disc that does not spin bounces on a rough floor, and leaves rolling."""
    radius, along, down, restitution, k = 0.5, 1.0, 2.0, 0.5, 0.5
    start = Disc(position_m=(0.0, radius + down * _TIME_S), velocity_m_s=(along, -down), radius_m=radius)
    scene = scene_of(
        discs=[start],
        walls=[FLOOR],
        wall_friction=0.5,
        wall_restitution=restitution,
        duration_s=2 * _TIME_S,
    )
    after = (along / (1 + k), restitution * down)
    spin = -after[0] / radius
    hit = KnownImpact(_TIME_S, 0, -1, after, spin_first_after=spin)
    source = "Cross, Am. J. Phys. 70 (2002) 1093: what grips leaves rolling, at v/(1 + k)"
    return Staged(scene, KnownAnswer(source, (hit,), 1, (after,), final_spin_rad_s=(spin,)))


@complained(
    package="tailuge/billiards",
    thread="https://github.com/tailuge/billiards/pull/298",
    reported="The object ball of a cut shot was thrown too little, by a stray factor of .3, and the limit up to which "
    "balls hold each other was wrong: it is a seventh of the slip.",
    made="Balls have the moment of inertia of spheres, as there; cut, speed and friction are ours.",
)
def _tailuge_298() -> Staged:
    """A cut shot in which the balls hold each other: the object ball leaves off the line of centres."""
    radius, speed, k, (nx, ny) = 0.028575, 2.0, 0.4, (0.8, 0.6)
    discs = [
        Disc(position_m=(-speed * _TIME_S, 0.0), velocity_m_s=(speed, 0.0), radius_m=radius, inertia_factor=k),
        Disc(position_m=(2 * radius * nx, 2 * radius * ny), radius_m=radius, inertia_factor=k),
    ]
    scene = scene_of(discs=discs, friction=0.5, duration_s=2 * _TIME_S)
    normal, tangential = speed * nx, speed * ny / (2 * (1 + 1 / k))  # of the slip, -speed ny, a seventh
    struck = (normal * nx + tangential * ny, normal * ny - tangential * nx)
    after, spin = ((speed - struck[0], -struck[1]), struck), tangential / k / radius
    hit = KnownImpact(_TIME_S, 0, 1, *after, spin, spin)
    source = "Alciatore, billiards TP A.14: the tangent of the throw is a seventh of that of the cut, with e = 1"
    return Staged(scene, KnownAnswer(source, (hit,), 1, after, final_spin_rad_s=(spin, spin)))
