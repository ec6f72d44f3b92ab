"""Formulas by which the known answers of scenes are computed.

Vectors in the plane are complex numbers here. Multiplication by a number of length 1 rotates a vector, and ``abs(a)``
is the length of a. An answer computed by the tested code would prove nothing. So this module, and the modules that
import it, do not call Carom's physics code or solvers. Most scenes are computed backwards: the author chooses the
normal and the instant of an impact, and straight motion back in time gives the start. So no equation has to be solved
for the time of impact.
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Sequence
from typing import Any, NamedTuple

from carom.catalogue.entry import KnownAnswer, KnownImpact, Staged
from carom.model.scene import Chain, Disc, Ring, Scene, Wall
from carom.model.trace import Vector


def to_vector(z: complex) -> Vector:
    """Return a complex number as (x, y)."""
    return (float(z.real), float(z.imag))


def dot(a: complex, b: complex) -> float:
    """Return the scalar product of two vectors."""
    return a.real * b.real + a.imag * b.imag


def unit(a: complex) -> complex:
    """Return the direction of a vector."""
    return a / abs(a)


def build_disc(position: complex, velocity: complex, radius_m: float, mass_kg: float = 1.0, **fields: Any) -> Disc:
    """Return a disc. The numbers are in metres, metres per second and kilograms."""
    place, speed = to_vector(position), to_vector(velocity)
    return Disc(position_m=place, velocity_m_s=speed, radius_m=radius_m, mass_kg=mass_kg, **fields)


def build_scene(discs: Sequence[Disc], *, pull: float = 0.0, **fields: Any) -> Scene:
    """Return a scene without a name; the catalogue adds the name. `pull` is the downward acceleration of gravity."""
    if pull:
        fields["gravity_m_s2"] = (0.0, -pull)
    return Scene(name="unnamed", discs=discs, **fields)


def build_impact(
    time_s: float,
    first: int,
    second: int,
    first_after: complex,
    second_after: complex | None = None,
    *spins_after: float,
) -> KnownImpact:
    """Return a known impact. For an impact on a wall, `second_after` is None."""
    velocity_second = None if second_after is None else to_vector(second_after)
    return KnownImpact(time_s, first, second, to_vector(first_after), velocity_second, *spins_after)


def compute_normal(approach: complex, offset: float) -> complex:
    """Return the normal of an impact: the unit vector from the first to the second disc.

    Args:
        approach: Velocity of the first disc relative to the second.
        offset: Sine of the angle from the direction of approach to the normal; 0 for a head-on impact. If the offset is
            positive, the second disc is to the left of the path.
    """
    return unit(approach) * complex(math.sqrt(1.0 - offset * offset), offset)


def compute_after_impact(
    m1: float, v1: complex, m2: float, v2: complex, normal: complex, restitution: float = 1.0
) -> tuple[complex, complex]:
    """Return both velocities after an impact.

    Relative to the common centre of mass, the normal component of each velocity is multiplied by -e.

    Args:
        m1: Mass of the first disc, in kilograms.
        v1: Velocity of the first disc before the impact.
        m2: Mass of the second disc, in kilograms; infinity for an immovable disc.
        v2: Velocity of the second disc before the impact.
        normal: Unit vector from first to second.
        restitution: Coefficient of restitution e.
    """
    n1, n2 = dot(v1, normal), dot(v2, normal)
    centre = n2 if math.isinf(m2) else (m1 * n1 + m2 * n2) / (m1 + m2)
    bounce_factor = 1.0 + restitution
    return v1 + bounce_factor * (centre - n1) * normal, v2 + bounce_factor * (centre - n2) * normal


def compute_after_wall(velocity: complex, normal: complex, restitution: float = 1.0) -> complex:
    """Return the velocity after an impact on a wall: the component along the normal is multiplied by -e."""
    along = 1j * normal
    return dot(velocity, along) * along - restitution * dot(velocity, normal) * normal


def compute_fall(position: complex, velocity: complex, time_s: float, pull: complex) -> tuple[complex, complex]:
    """Return position and velocity after `time_s` seconds under a constant acceleration."""
    return position + velocity * time_s + pull * (time_s * time_s / 2), velocity + pull * time_s


def stage_meeting(
    velocity: tuple[complex, complex],
    radius_m: tuple[float, float],
    *,
    mass_kg: tuple[float, float] = (1.0, 1.0),
    offset: float = 0.0,
    time_s: float,
    source: str = "Computed backwards from the impact; conservation of momentum and Newton's law of restitution give "
    "the velocities",
    **fields: float,
) -> Staged:
    """Build a scene in which two discs meet at the origin. For `offset`, see `compute_normal`."""
    (v0, v1), (r0, r1), (m0, m1) = velocity, radius_m, mass_kg
    normal = compute_normal(v0 - v1, offset)
    discs = [build_disc(-r0 * normal - v0 * time_s, v0, r0, m0), build_disc(r1 * normal - v1 * time_s, v1, r1, m1)]
    after = compute_after_impact(m0, v0, m1, v1, normal, fields.get("restitution", 1.0))
    return build_staged(build_scene(discs, **fields), [build_impact(time_s, 0, 1, *after)], source)


def stage_at_wall(
    velocity: complex,
    radius_m: float,
    normal: complex,
    walls: Sequence[Wall | Chain | Ring],
    source: str,
    *,
    time_s: float,
    duration_s: float | None = None,
    point: complex = 0,
    drive: complex = 0,
    restitution: float = 1.0,
) -> Staged:
    """Build a scene in which a disc hits the first wall at `point`. `normal` points from `point` to the disc's centre.

    By default, the scene ends after twice the time of the impact.
    """
    disc = build_disc(point + radius_m * normal - velocity * time_s, velocity, radius_m)
    hit = build_impact(time_s, 0, -1, drive + compute_after_wall(velocity - drive, normal, restitution))
    scene = build_scene([disc], walls=walls, wall_restitution=restitution, duration_s=duration_s or 2.0 * time_s)
    return build_staged(scene, [hit], source)


class WedgeImpact(NamedTuple):
    """Impact of a moving point on a side of a wedge.

    Attributes:
        time_s: Seconds from the start.
        upper: True for an impact on the upper side of the wedge. The lower side is at angle 0.
        velocity: Velocity of the point after the impact.
    """

    time_s: float
    upper: bool
    velocity: complex


def compute_wedge_impacts(start: complex, velocity: complex, angle: float) -> list[WedgeImpact]:
    """Compute, by unfolding, all impacts of a point that moves in a wedge and is reflected by the wedge's two sides.

    At each impact, the wedge is mirrored at the side that the point hits, and the path continues straight
    ("unfolding"). The straight path crosses rays from the apex at 1, 2, 3, ... times the wedge's angle. The n-th
    crossing is at the time t at which ``(start + t velocity) exp(-i n angle)`` is real. In the original wedge, the
    velocity after the n-th impact is ``velocity exp(-i n angle)`` for even n, and ``conj(velocity) exp(i (n + 1)
    angle)`` for odd n.

    Args:
        start: Position of the point at the start. The apex of the wedge is at 0, and the argument of `start` is between
            0 and `angle`.
        velocity: Velocity of the point at the start. The point moves anticlockwise around the apex, so it hits the
            upper side first.
        angle: Angle of the wedge, below pi.
    """
    impacts = []
    n = 1
    # Seen from the apex, the direction of the point approaches the direction of its velocity. So the path crosses only
    # rays at smaller angles than the angle of the velocity.
    while n * angle < cmath.phase(velocity) % math.tau:
        turn = cmath.exp(-1j * n * angle)
        time = -(start * turn).imag / (velocity * turn).imag
        folded = velocity * turn if n % 2 == 0 else velocity.conjugate() * cmath.exp(1j * (n + 1) * angle)
        impacts.append(WedgeImpact(time, n % 2 == 1, folded))
        n += 1
    return impacts


def stage_struck_row(
    gaps_m: Sequence[float],
    convention: str = "",
    *,
    radius_m: float,
    speed: float,
    duration_s: float,
    frame_rate_hz: float = 60.0,
) -> Staged:
    """Build a scene with a striker and a row of equal discs at rest.

    `gaps_m` are the gaps between neighbours. The first gap is between the striker and the row.
    """
    position, time = 0.0, 0.0
    discs = [build_disc(0, speed, radius_m)]
    impacts = []
    for k, gap in enumerate(gaps_m):
        position += 2 * radius_m + gap
        time += gap / speed
        discs.append(build_disc(position, 0, radius_m))
        impacts.append(build_impact(time, k, k + 1, 0, speed))
    scene = build_scene(discs, duration_s=duration_s, frame_rate_hz=frame_rate_hz)
    source = "Equal masses exchange velocities, so each impact passes the striker's velocity on to the next disc"
    return build_staged(scene, impacts, source, convention)


def build_staged(
    scene: Scene,
    impacts: Sequence[KnownImpact],
    source: str,
    convention: str = "",
    final: Sequence[tuple[complex, complex]] | None = None,
    spins: tuple[float, ...] | None = None,
) -> Staged:
    """Return a scene with its answer, for scenes in which every impact is known.

    Args:
        scene: The scene.
        impacts: All impacts of the scene.
        source: Source of the answer.
        convention: Why physics allows several answers, and by which rule this answer was chosen. Empty if physics
            allows only one answer.
        final: Position and velocity of each disc at the end. If None, they are computed from the impacts, which
            requires straight motion between impacts.
        spins: Spin of each disc at the end; None if unknown.
    """
    ends = zip(*(_compute_end_states(scene, impacts) if final is None else final), strict=True)
    position, velocity = (tuple(map(to_vector, values)) for values in ends)
    return Staged(scene, KnownAnswer(source, tuple(impacts), len(impacts), velocity, position, None, convention, spins))


def _compute_end_states(scene: Scene, impacts: Sequence[KnownImpact]) -> list[tuple[complex, complex]]:
    position = [complex(*body.position_m) for body in scene.discs]
    velocity = [complex(*body.velocity_m_s) for body in scene.discs]
    since = [0.0] * len(position)
    for known in impacts:
        for body, after in ((known.first, known.velocity_first_after), (known.second, known.velocity_second_after)):
            if body >= 0 and after is not None:
                position[body] += velocity[body] * (known.time_s - since[body])
                velocity[body], since[body] = complex(*after), known.time_s
    return [(p + v * (scene.duration_s - t), v) for p, v, t in zip(position, velocity, since, strict=True)]
