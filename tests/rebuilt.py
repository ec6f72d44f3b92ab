"""A scene seen otherwise, turned, moving along or in other units, and what its trace must be then."""

from __future__ import annotations

import cmath
from collections.abc import Callable

import numpy as np

from carom import Disc, Scene, Trace, Wall
from carom.trace import Vector

Map = Callable[[Vector], Vector]


def same(v: Vector) -> Vector:
    return v


def mirrored(v: Vector) -> Vector:
    return (v[0], -v[1])


def quarter_turned(v: Vector) -> Vector:
    return (-v[1], v[0])


def turned(angle: float) -> Map:
    turn = cmath.rect(1.0, angle)

    def apply(v: Vector) -> Vector:
        z = complex(*v) * turn
        return (z.real, z.imag)

    return apply


def rebuilt(
    scene: Scene,
    position: Map,
    velocity: Map,
    turn: Map = same,
    *,
    length: float = 1.0,
    time: float = 1.0,
    mass: float = 1.0,
) -> Scene:
    """Return a scene without friction, each vector mapped, in units of measurement that are so many times smaller.

    `turn` maps normals and gravity.
    """
    speed = length / time

    def scaled(v: Vector, by: float) -> Vector:
        return (v[0] * by, v[1] * by)

    return Scene(
        name=scene.name,
        discs=[
            Disc(
                position_m=scaled(position(disc.position_m), length),
                velocity_m_s=scaled(velocity(disc.velocity_m_s), speed),
                radius_m=disc.radius_m * length,
                mass_kg=disc.mass_kg * mass,
            )
            for disc in scene.discs
        ],
        walls=[
            Wall(point_m=scaled(position(wall.point_m), length), normal=turn(wall.normal))
            for wall in scene.half_planes()
        ],
        restitution=scene.restitution,
        wall_restitution=scene.wall_restitution,
        gravity_m_s2=scaled(scaled(turn(scene.gravity_m_s2), speed), 1.0 / time),
        duration_s=scene.duration_s * time,
        frame_rate_hz=scene.frame_rate_hz / time,
    )


def in_units(scene: Scene, *, length: float = 1.0, time: float = 1.0, mass: float = 1.0) -> Scene:
    """Return the scene in units that are so many times smaller."""
    return rebuilt(scene, same, same, length=length, time=time, mass=mass)


def assert_mirrored(scene: Scene, turn: Map, solve: Callable[[Scene], Trace]) -> None:
    """Assert that a scene whose axes are mirrored or exchanged has the trace of which just that is true, to the bit."""
    plain, other = solve(scene), solve(rebuilt(scene, turn, turn, turn))
    matrix = np.array([turn((1.0, 0.0)), turn((0.0, 1.0))])
    for name in ("time_s", "first", "second"):
        assert other.impacts[name].tolist() == plain.impacts[name].tolist()
    for name in ("normal", "velocity_first_after", "velocity_second_after"):
        assert np.array_equal(other.impacts[name], plain.impacts[name] @ matrix)
    assert np.array_equal(other.final_position_m, plain.final_position_m @ matrix)
    assert np.array_equal(other.final_velocity_m_s, plain.final_velocity_m_s @ matrix)


def assert_scaled(plain: Trace, other: Trace, *, length: float, time: float) -> None:
    """Assert that two traces differ by units that are powers of two, and in no bit besides."""
    speed = length / time
    assert other.outcome == plain.outcome
    assert other.ambiguous == plain.ambiguous
    assert other.end_time_s == plain.end_time_s * time
    assert other.dt_s == plain.dt_s * time
    for name in plain.impacts.dtype.names or ():
        unit = time if name == "time_s" else speed if name.startswith("velocity") else 1
        assert np.array_equal(other.impacts[name], plain.impacts[name] * unit)
    assert np.array_equal(other.final_position_m, plain.final_position_m * length)
    assert np.array_equal(other.final_velocity_m_s, plain.final_velocity_m_s * speed)
    if plain.samples is not None:
        assert other.samples is not None
        assert np.array_equal(other.samples.time_s, plain.samples.time_s * time)
        assert np.array_equal(other.samples.position_m, plain.samples.position_m * length)
