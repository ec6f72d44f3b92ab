"""The group `driven`: scenes with paddles, pistons, mallets and moving boxes. Formulas give the answers.

For an observer who moves with a driven body, an impact is like an impact on a wall or disc at rest. So each answer is
computed in the frame of the driven body: see `docs/theory/walls.md`. The group runs only if the user names it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from fractions import Fraction

from carom.catalogue.closed_forms import compute_after_impact
from carom.catalogue.entry import KnownAnswer, KnownImpact, Staged
from carom.catalogue.groups.classics_walled import edges, stage_in_room, upright
from carom.catalogue.staging import build_disc, build_impact, build_scene, build_staged, stage, stage_at_wall, to_vector
from carom.model.scene import Wall

LAW = "Newton's law relative to a driven body of velocity V: v' = V - e (v - V) along the normal"


def _paddle() -> Staged:
    """A disc at 2 m/s meets a wall that approaches at 1 m/s, and returns at 4 m/s."""
    wall = Wall(point_m=(0.0, 0.0), normal=(1.0, 0.0), velocity_m_s=(1.0, 0.0))
    scene = build_scene([build_disc(3.5625, -2, 0.5)], walls=[wall], duration_s=2.0)
    return build_staged(scene, [build_impact(3.0625 / 3, 0, -1, 4)], f"{LAW}: 2 V - v")


def _racket() -> Staged:
    """A tilted racket without thickness strikes an approaching disc, and their closing speed decreases by a fifth."""
    drive, velocity, time = 3 + 1j, -4 + 0.5j, 0.51
    normal = 0.8 + 0.6j  # the racket itself has the direction (-0.6, 0.8)
    foot = 0.25j  # the point of the racket that the disc touches when they meet
    ends = [foot + offset * 1j * normal - drive * time for offset in (-0.75, 0.5)]
    walls = [edges(*ends, velocity_m_s=to_vector(drive))]
    laws = {"restitution": 0.8, "time_s": time, "duration_s": 1.25}
    return stage_at_wall(velocity, 0.125, normal, walls, LAW, point=foot, drive=drive, **laws)


def _swatter() -> Staged:
    """A swatter without thickness moves at 50 m/s, and must not pass through a disc at rest."""
    radius, speed = 0.125, 50.0
    swatter = edges(-10 - 1j, -10 + 1j, velocity_m_s=(speed, 0.0))
    scene = build_scene([build_disc(0.25j, 0, radius)], walls=[swatter], duration_s=0.5)
    return build_staged(scene, [build_impact((10.0 - radius) / speed, 0, -1, 2.0 * speed)], f"{LAW}: 2 V")


def _tip_of_a_racket() -> Staged:
    """A disc that moves sideways meets the tip of a rising racket."""
    drive, time = 2j, 0.51
    normal = complex(0.8, 0.6)  # points from the tip to the disc's centre
    tip = -drive * time  # the tip is at the origin when they meet
    racket = edges(tip, tip - 1j, velocity_m_s=to_vector(drive))
    source = f"{LAW}, which points from the tip to the disc"
    return stage_at_wall(-3, 0.25, normal, [racket], source, drive=drive, time_s=time, duration_s=1.25)


def _mallet() -> Staged:
    """A mallet hits a puck off centre, and the mallet keeps its velocity."""
    radii, source = (0.5, 0.5), f"{LAW}, which is the line of centres"
    return stage_at_mallet(0.5 - 1j, -1 + 1j, 0.6 - 0.8j, 0.8125, radius_m=radii, source=source, duration_s=2.0)


def stage_at_mallet(
    velocity: complex,
    drive: complex,
    normal: complex,
    time_s: float,
    *,
    radius_m: tuple[float, float] = (0.0625, 0.125),
    source: str = LAW,
    duration_s: float | None = None,
    restitution: float = 1.0,
) -> Staged:
    """Build a scene in which a puck meets a mallet. `velocity` is the puck's velocity, and `drive` is the mallet's.

    `normal` points from puck to mallet when they meet. `radius_m` contains the radii of puck and mallet. By default,
    the scene ends after twice the time of the impact.
    """
    puck, mallet = -velocity * time_s, sum(radius_m) * normal - drive * time_s
    discs = [build_disc(puck, velocity, radius_m[0]), build_disc(mallet, drive, radius_m[1], math.inf, driven=True)]
    scene = build_scene(discs, restitution=restitution, duration_s=duration_s or 2.0 * time_s)
    after, _ = compute_after_impact(1.0, velocity, math.inf, drive, normal, restitution)
    return build_staged(scene, [build_impact(time_s, 0, 1, after, drive)], source)


def stage_before_paddle(
    speed: Fraction, length: Fraction, legs: Sequence[tuple[Fraction, Fraction]], duration: Fraction, source: str
) -> Staged:
    """Build a scene in which a disc starts a metre from a wall, and bounces between this wall and a paddle.

    The answer is computed in rational numbers.

    Args:
        speed: Velocity of the disc away from the wall.
        length: Initial distance of the paddle from the wall.
        legs: Start time and velocity of each straight part of the paddle's motion. Velocities point away from the wall.
        duration: Duration of the scene.
        source: Source of the answer.
    """
    start, radius, place, paddle, time = speed, Fraction(1, 4), Fraction(1), length, Fraction(0)
    impacts: list[KnownImpact] = []
    for (_, drive), end in zip(legs, [*(begin for begin, _ in legs[1:]), duration], strict=True):
        body = -1
        while body:
            waits = [(end - time, 0)]
            waits += [((place - radius) / -speed, -1)] if speed < 0 else []
            waits += [((paddle - radius - place) / (speed - drive), -2)] if speed > drive else []
            wait, body = min(waits)
            place, paddle, time = place + speed * wait, paddle + drive * wait, time + wait
            if body:
                speed = -speed if body == -1 else 2 * drive - speed
                impacts.append(build_impact(float(time), 0, body, float(speed)))
    path = [{"from_s": float(begin), "velocity_m_s": (float(drive), 0.0)} for begin, drive in legs]
    moves = {"legs": path} if len(path) > 1 else {"velocity_m_s": path[0]["velocity_m_s"]}
    walls = [upright(0.0, 1), Wall(point_m=(float(length), 0.0), normal=(-1.0, 0.0), **moves)]
    scene = build_scene([build_disc(1, float(start), 0.25)], walls=walls, duration_s=float(duration))
    return build_staged(scene, impacts, source, final=[(float(place), float(speed))])


def _stage_in_cylinder(drive: Fraction, duration: Fraction) -> Staged:
    """Build a scene with a disc that starts midway between a wall and a piston, at 1 m/s towards the wall."""
    source = "Each impact on a piston of speed U adds 2 U to the disc's speed (Ulam, 1961); times are exact fractions"
    return stage_before_paddle(Fraction(-1), Fraction(2), [(Fraction(0), drive)], duration, source)


def _piston() -> Staged:
    """A piston approaches a wall, and a disc between them gets faster at each of a dozen impacts on the piston."""
    return _stage_in_cylinder(Fraction(-1, 2), Fraction(93, 32))


def _crush() -> Staged:
    """A piston crushes a disc against a wall after 3 s. The disc has infinitely many impacts before that."""
    staged = _stage_in_cylinder(Fraction(-1, 2), Fraction(93, 32))
    source = (
        "The free space of 1.5 m decreases by 0.5 m/s, so it is 0 after 3 s; each impact on a piston of speed U adds 2 "
        "U to the disc's speed (Ulam, 1961)"
    )
    scene = staged.scene.model_copy(update={"duration_s": 4.0})
    return Staged(scene, KnownAnswer(source, staged.known.impacts))


def _piston_that_recedes() -> Staged:
    """A piston recedes from a disc. Each impact on the piston slows the disc down, until the disc can't catch up."""
    return _stage_in_cylinder(Fraction(1, 8), Fraction(64))


def _moving_box() -> Staged:
    """A disc bounces in a moving box of four edges. An observer who moves with the box sees a box at rest."""
    return stage_in_room(1.109375 + 0.765625j, 1.71875 + 0.6328125j, 0.25, 4.0, 3.0, 20.0, drive=3 - 2j)


def _lift() -> Staged:
    """A ball bounces on a floor that rises at a constant speed, as in a lift."""
    return stage_on_lift(1.5)


def stage_on_lift(rise: float) -> Staged:
    """Build a scene in which a ball starts at rest, falls on a floor that moves upwards, and bounces three times."""
    pull, speed, radius, restitution = 8.0, 5.0, 0.5, 0.5
    height = 0.5 * speed**2 / pull  # relative to the floor, the ball starts at this height with the velocity -rise
    lands = math.sqrt(rise**2 + 2.0 * pull * height)
    impacts, time, leaving = [], (lands - rise) / pull, restitution * lands
    count = 3
    for _ in range(count):
        impacts.append(build_impact(time, 0, -1, complex(0.0, rise + leaving)))
        hop, leaving = 2.0 * leaving / pull, restitution * leaving
        time += hop
    duration = time - hop / 2.0  # the scene ends at the top of the last hop
    top = 0.5 * (leaving / restitution) ** 2 / pull
    end = complex(0.0, radius + rise * duration + top), complex(0.0, rise)
    floor = Wall(point_m=(0.0, 0.0), normal=(0.0, 1.0), velocity_m_s=(0.0, rise))
    discs = [build_disc(complex(0.0, radius + height), 0, radius)]
    scene = build_scene(discs, walls=[floor], wall_restitution=restitution, pull=pull, duration_s=duration)
    return build_staged(scene, impacts, "Galileo: free fall and Newton's law, relative to the floor", final=[end])


def _start_at_a_touch() -> Staged:
    """A wall at rest that touches a disc starts to move, and strikes the disc at that instant."""
    legs = ({"from_s": 0.0, "velocity_m_s": (0.0, 0.0)}, {"from_s": 0.75, "velocity_m_s": (1.5, 0.0)})
    wall = Wall(point_m=(0.0, 0.0), normal=(1.0, 0.0), legs=legs)
    source = f"{LAW}; the disc gets the velocity 2 V when the wall starts"
    return stage([build_disc(0.25, 0, 0.25)], [build_impact(0.75, 0, -1, 3)], source, walls=[wall], duration_s=2.0)


def _paddle_to_and_fro() -> Staged:
    """A paddle advances, stops and recedes while a disc bounces between the paddle and a wall."""
    legs = [(Fraction(0), Fraction(-1, 2)), (Fraction(2), Fraction(0)), (Fraction(7, 2), Fraction(3, 4))]
    source = f"{LAW}, with a new V for each part of the paddle's motion; times are exact fractions"
    return stage_before_paddle(Fraction(-3), Fraction(4), legs, Fraction(6), source)


def _fast_cup() -> Staged:
    """A ball starts at rest inside a cup that moves at 20 m/s. The cup carries the ball along."""
    radius, width, drive, place = 0.25, 2.0, 20.0, 1.0
    cup = edges(2j, 0 - 1j, width - 1j, width + 2j, velocity_m_s=(drive, 0.0))
    scene = build_scene([build_disc(place, 0, radius)], walls=[cup], duration_s=0.4)
    time, impacts, speed = (place - radius) / drive, list[KnownImpact](), 2.0 * drive
    while time < scene.duration_s:
        impacts.append(build_impact(time, 0, -1, speed))
        time, speed = time + (width - 2.0 * radius) / drive, 2.0 * drive - speed
    source = "Galileo: relative to the cup, the cup is at rest and the ball starts at the velocity -V"
    return build_staged(scene, impacts, source)


def _conveyor() -> Staged:
    """A ball is dropped on a conveyor. Friction ends the slip, so the ball spins and leaves in the belt's direction."""
    belt = 1.5
    floor = Wall(point_m=(0.0, 0.0), normal=(0.0, 1.0), surface_speed_m_s=belt)
    source = "Coulomb's law: friction ends the slip, so the ball gets 1/(1 + 1/k) of the belt's speed"
    return on_a_moving_surface(floor, -belt, 1.0, source)


def on_a_moving_surface(floor: Wall, speed: float, friction: float, source: str) -> Staged:
    """Build a scene in which a ball comes straight down on a rough surface that moves to the right at `speed`."""
    radius, down, time, k = 0.25, 2.0, 0.5, 0.5
    ball = build_disc(complex(0.0, radius + down * time), complex(0.0, -down), radius)
    scene = build_scene([ball], walls=[floor], wall_friction=friction, duration_s=2.0 * time)
    # Strong friction ends the slip: the ball gets 1/(1 + 1/k) of the surface's speed. Weak friction has the largest
    # impulse that Coulomb's law allows.
    change = math.copysign(min(abs(speed) / (1.0 + 1.0 / k), friction * 2.0 * down), speed)
    after, spin = complex(change, down), change / k / radius
    end = complex(0.0, radius) + after * time, after
    return build_staged(scene, [build_impact(time, 0, -1, after, None, spin)], source, final=[end], spins=(spin,))
