"""A scene seen otherwise, turned, moving along or in other units, and what its trace must be then."""

from __future__ import annotations

import cmath
import math
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
    """Return a scene, each vector mapped, in units of measurement that are so many times smaller.

    `turn` maps normals and gravity; spins change their sign where it is a mirror. Nothing may be driven.
    """
    speed, hand = length / time, turn((1.0, 0.0))[0] * turn((0.0, 1.0))[1] - turn((1.0, 0.0))[1] * turn((0.0, 1.0))[0]

    def scaled(v: Vector, by: float) -> Vector:
        return (v[0] * by, v[1] * by)

    def placed(disc: Disc) -> Disc:
        spin = math.copysign(1.0, hand) * disc.spin_rad_s / time if disc.spin_rad_s else 0.0
        sizes = {"radius_m": disc.radius_m * length, "mass_kg": disc.mass_kg * mass, "spin_rad_s": spin}
        moves = {"position_m": scaled(position(disc.position_m), length)}
        moves["velocity_m_s"] = scaled(velocity(disc.velocity_m_s), speed)
        return Disc(**{**dict(disc), **sizes, **moves})

    def stood(wall: Wall) -> Wall:
        moves = {"point_m": scaled(position(wall.point_m), length), "normal": turn(wall.normal)}
        return Wall(**{**dict(wall), **moves})

    fields = {
        "discs": [placed(disc) for disc in scene.discs],
        "walls": [stood(wall) for wall in scene.half_planes()],
        "gravity_m_s2": scaled(scaled(turn(scene.gravity_m_s2), speed), 1.0 / time),
        "damping_per_s": scene.damping_per_s / time,
        "table_deceleration_m_s2": scene.table_deceleration_m_s2 * speed / time,
        "duration_s": scene.duration_s * time,
        "frame_rate_hz": scene.frame_rate_hz / time,
    }
    return Scene(**{**dict(scene), **fields})


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
    if plain.spins is not None and plain.final_spin_rad_s is not None:
        hand = float(np.linalg.det(matrix))
        assert other.spins is not None
        for name in plain.spins.dtype.names or ():
            assert np.array_equal(other.spins[name], plain.spins[name] * hand), name
        assert other.final_spin_rad_s is not None
        assert np.array_equal(other.final_spin_rad_s, plain.final_spin_rad_s * hand)
    assert np.array_equal(other.final_position_m, plain.final_position_m @ matrix)
    assert np.array_equal(other.final_velocity_m_s, plain.final_velocity_m_s @ matrix)


def assert_scaled(plain: Trace, other: Trace, *, length: float, time: float) -> None:
    """Assert that two traces differ by units that are powers of two, and in no bit besides."""
    speed = length / time
    assert other.outcome == plain.outcome
    assert other.ambiguous == plain.ambiguous
    assert other.end_time_s == plain.end_time_s * time
    assert other.dt_s == plain.dt_s * time
    units = {"time_s": time, "position": length, "velocity": speed, "acceleration": speed / time}
    units |= {"spin": 1.0 / time, "spin_rate": 1.0 / time**2}
    units |= {f"velocity_{side}_{when}": speed for side in ("first", "second") for when in ("before", "after")}
    rows = [(plain.impacts, other.impacts)]
    if plain.modes is not None:
        assert other.modes is not None
        rows.append((plain.modes, other.modes))
    for one, two in rows:
        for name in one.dtype.names or ():
            assert np.array_equal(two[name], one[name] * units.get(name, 1)), name
    if plain.spins is not None and plain.final_spin_rad_s is not None:
        assert other.spins is not None
        for name in plain.spins.dtype.names or ():
            assert np.array_equal(other.spins[name], plain.spins[name] / time), name
        assert other.final_spin_rad_s is not None
        assert np.array_equal(other.final_spin_rad_s, plain.final_spin_rad_s / time)
    assert np.array_equal(other.final_position_m, plain.final_position_m * length)
    assert np.array_equal(other.final_velocity_m_s, plain.final_velocity_m_s * speed)
    if plain.samples is not None:
        assert other.samples is not None
        assert np.array_equal(other.samples.time_s, plain.samples.time_s * time)
        assert np.array_equal(other.samples.position_m, plain.samples.position_m * length)
