"""Scenes of a few bodies in as few lines: SI units, as everywhere."""

from __future__ import annotations

from typing import Any

from carom import Disc, Scene, Wall


def disc_at(
    x: float, y: float, vx: float = 0.0, vy: float = 0.0, *, r: float = 0.5, m: float = 1.0, **more: Any
) -> Disc:
    """Return a disc at a place with a velocity, a radius and a mass; `more` is spin and inertia."""
    return Disc(position_m=(x, y), velocity_m_s=(vx, vy), radius_m=r, mass_kg=m, **more)


def wall_at(x: float, y: float, nx: float, ny: float) -> Wall:
    """Return a wall through a point, with the normal that points into the free side."""
    return Wall(point_m=(x, y), normal=(nx, ny))


def staged(name: str, *bodies: Disc | Wall, **fields: Any) -> Scene:
    """Return the scene of some bodies; `fields` are the others of a scene."""
    discs = [body for body in bodies if isinstance(body, Disc)]
    walls = [body for body in bodies if isinstance(body, Wall)]
    return Scene(name=name, discs=discs, walls=walls, **fields)


def line(*positions: float, velocities: tuple[float, ...], restitution: float = 1.0, duration_s: float = 10.0) -> Scene:
    """Return discs of 1 kg and radius 0.5 on the x axis."""
    return staged(
        "line",
        *[disc_at(x, 0.0, v, 0.0) for x, v in zip(positions, velocities, strict=True)],
        restitution=restitution,
        duration_s=duration_s,
    )
