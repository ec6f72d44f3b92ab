"""A scene seen otherwise, turned, moving along or in other units, and what its trace must be then."""

import cmath
import math
from collections.abc import Callable

import numpy as np

from carom import Disc, Scene, Trace, Wall
from carom.model.trace import Vector

Map = Callable[[Vector], Vector]


def identity(v: Vector) -> Vector:
    return v


def mirror(v: Vector) -> Vector:
    return (v[0], -v[1])


def turn_quarter(v: Vector) -> Vector:
    return (-v[1], v[0])


def turn_by(angle: float) -> Map:
    turn = cmath.rect(1.0, angle)

    def apply(v: Vector) -> Vector:
        z = complex(*v) * turn
        return (z.real, z.imag)

    return apply


def transform_scene(
    scene: Scene,
    position: Map,
    velocity: Map,
    turn: Map = identity,
    *,
    length: float = 1.0,
    time: float = 1.0,
    mass: float = 1.0,
) -> Scene:
    """Return a scene, each vector mapped, in units of measurement that are smaller by a factor.

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
    """Return the scene in units that are smaller by a factor."""
    return transform_scene(scene, identity, identity, length=length, time=time, mass=mass)


def assert_transformed(
    plain: Trace, other: Trace, turn: Map = identity, *, length: float = 1.0, time: float = 1.0
) -> None:
    """Assert that two traces differ by axes mirrored or exchanged, or units that are powers of two: to the bit."""
    matrix, speed = np.array([turn((1.0, 0.0)), turn((0.0, 1.0))]), length / time
    turning = float(np.linalg.det(matrix)) / time
    assert (other.outcome, other.ambiguous) == (plain.outcome, plain.ambiguous)
    assert (other.end_time_s, other.dt_s) == (plain.end_time_s * time, plain.dt_s * time)
    units = {"time_s": time, "position": length, "velocity": speed, "acceleration": speed / time}
    units |= {"spin": turning, "spin_rate": turning / time}
    units |= {f"velocity_{side}_{when}": speed for side in ("first", "second") for when in ("before", "after")}
    units |= {f"{side}_{when}": turning for side in ("first", "second") for when in ("before", "after")}
    for one, two in ((plain.impacts, other.impacts), (plain.modes, other.modes), (plain.spins, other.spins)):
        if one is None or two is None:
            assert one is two
            continue
        for name in one.dtype.names or ():
            expected = one[name] if one[name].ndim == 1 else one[name] @ matrix
            assert np.array_equal(two[name], expected * units.get(name, 1)), name
    assert np.array_equal(other.final_position_m, plain.final_position_m @ matrix * length)
    assert np.array_equal(other.final_velocity_m_s, plain.final_velocity_m_s @ matrix * speed)
    if plain.final_spin_rad_s is not None:
        assert other.final_spin_rad_s is not None
        assert np.array_equal(other.final_spin_rad_s, plain.final_spin_rad_s * turning)
    if plain.samples is not None:
        assert other.samples is not None
        assert np.array_equal(other.samples.time_s, plain.samples.time_s * time)
        assert np.array_equal(other.samples.position_m, plain.samples.position_m @ matrix * length)
