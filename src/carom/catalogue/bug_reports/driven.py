"""Bug reports about driven bodies, which move at given velocities.

Balls pass through driven bodies, are pressed through walls, or bounce as if the driven body were at rest.
"""

from __future__ import annotations

from fractions import Fraction

from carom.catalogue.entry import Staged
from carom.catalogue.groups.classics_walled import edges
from carom.catalogue.groups.driven import LAW, on_a_moving_surface, stage_before_paddle
from carom.catalogue.staging import build_disc, build_impact, stage, stage_at_wall, to_vector
from carom.model.scene import Ring, Wall


def matter_js_672() -> Staged:
    """A ball strikes a moving paddle near the joint of paddle and flipper."""
    drive, time = 2, 0.305
    begins = -drive * time
    walls = [edges(begins + a, begins + b, velocity_m_s=to_vector(drive)) for a, b in ((-1j, 0), (0, -0.6 + 0.8j))]
    source = f"{LAW}, so the ball leaves the paddle at 2 V - v"
    return stage_at_wall(-6, 0.25, 1, walls, source, point=-0.0625j, drive=drive, time_s=time)


def visualpinball_322() -> Staged:
    """A ball and a moving post meet at an angle, and each moves by more than its radius within a frame."""
    drive, post, time = 3 + 12j, 0.0625, 0.255
    normal = complex(-0.28, 0.96)  # points from the post to the ball
    wall = Ring(centre_m=to_vector(-drive * time), radius_m=post, velocity_m_s=to_vector(drive))
    return stage_at_wall(4 - 9j, 0.125, normal, [wall], LAW, point=post * normal, drive=drive, time_s=time)


def pinball_470() -> Staged:
    """A flipper at full speed meets a ball that falls towards the flipper."""
    drive, time = -9 + 12j, 0.155
    ends = (along * complex(0.8, 0.6) - drive * time for along in (-0.5, 1.0))
    flipper = edges(*ends, velocity_m_s=to_vector(drive))
    return stage_at_wall(1 - 4j, 0.25, complex(-0.6, 0.8), [flipper], LAW, drive=drive, time_s=time)


def pico8_pinball_6() -> Staged:
    """The end of a rising flipper hits a very slow ball."""
    drive, time = 3j, 0.305
    normal, tip = complex(0.28, 0.96), -drive * time  # points from the flipper's end to the ball
    flipper = edges(tip - 1, tip, velocity_m_s=to_vector(drive))
    source = f"{LAW}, which points from the flipper's end to the ball"
    return stage_at_wall(0.0625, 0.25, normal, [flipper], source, drive=drive, time_s=time, restitution=0.9)


def escape_space_1() -> Staged:
    """A paddle strikes a ball at rest, which then meets a thin wall at twice the paddle's speed."""
    drive, radius, gap, room = 6.0, 0.125, 1.5, 2.25
    paddle = edges(complex(-radius - gap, -1), complex(-radius - gap, 1), velocity_m_s=(drive, 0.0))
    wall = edges(complex(radius + room, -1), complex(radius + room, 1))
    strike_s, return_s = gap / drive, gap / drive + room / (2.0 * drive)
    impacts = [build_impact(strike_s, 0, -1, 2 * drive + 0), build_impact(return_s, 0, -2, -2 * drive + 0)]
    return stage([build_disc(0, 0, radius)], impacts, LAW, walls=[paddle, wall], duration_s=return_s + 0.03125)


def ball2box_21() -> Staged:
    """A box approaches a wall with a ball between them, and turns back when it has almost crushed the ball."""
    legs = [(Fraction(0), Fraction(-3, 4)), (Fraction(29, 16), Fraction(3))]
    return stage_before_paddle(Fraction(-2), Fraction(2), legs, Fraction(35, 16), f"{LAW}; times are exact fractions")


def on_a_platform(drive: float, friction: float) -> Staged:
    """Build a scene in which a ball falls straight down on a rough platform that moves to the right."""
    floor = Wall(point_m=(0.0, 0.0), normal=(0.0, 1.0), velocity_m_s=(drive, 0.0))
    source = "Coulomb's law: friction either ends the slip, or the impulse of friction is f times the normal impulse"
    return on_a_moving_surface(floor, drive, friction, source)
