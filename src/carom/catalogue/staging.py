"""Builders of scenes with known answers. Vectors are complex numbers, as in `carom.catalogue.closed_forms`.

Most scenes are computed backwards: the author chooses the normal and the instant of an impact, and straight motion back
in time gives the start. So no equation has to be solved for the time of impact.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from carom.catalogue.closed_forms import compute_after_impact, compute_after_wall, compute_normal
from carom.catalogue.entry import KnownAnswer, KnownImpact, Staged
from carom.model.scene import Chain, Disc, Ring, Scene, Wall
from carom.model.trace import Vector


def to_vector(z: complex) -> Vector:
    """Return a complex number as (x, y)."""
    return (float(z.real), float(z.imag))


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


def stage(
    discs: Sequence[Disc], impacts: Sequence[KnownImpact], source: str, convention: str = "", **fields: Any
) -> Staged:
    """Build a scene in which discs move straight between impacts, and return it with its answer."""
    return build_staged(build_scene(discs, **fields), impacts, source, convention)


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
        final: Position and velocity of each disc at the end. If None, the final state is computed from the impacts,
            which requires straight motion between impacts.
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
