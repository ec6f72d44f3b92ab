"""A scene measured in other units is the same scene: scaling by powers of two changes exponents, and no other bit."""

from __future__ import annotations

import math
import random
from collections.abc import Callable
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from carom import Disc, Scene, Trace, Wall, solve_pic, solve_pic_framewise, solve_pit

if TYPE_CHECKING:
    from carom.trace import Vector

#: How far each unit is changed: well within `carom.limits`, which also have to hold the scene.
MOST = 500


class Powers(NamedTuple):
    """Powers of two by which lengths, times and masses are multiplied."""

    length: int = 0
    time: int = 0
    mass: int = 0

    @property
    def speed(self) -> int:
        return self.length - self.time


def scaled(scene: Scene, by: Powers) -> Scene:
    """Return a scene with every number multiplied by its power of two."""

    def vector(v: Vector, power: int) -> Vector:
        return (math.ldexp(v[0], power), math.ldexp(v[1], power))

    return Scene(
        name=scene.name,
        discs=[
            Disc(
                position_m=vector(disc.position_m, by.length),
                velocity_m_s=vector(disc.velocity_m_s, by.speed),
                radius_m=math.ldexp(disc.radius_m, by.length),
                mass_kg=math.ldexp(disc.mass_kg, by.mass),
            )
            for disc in scene.discs
        ],
        walls=[Wall(point_m=vector(wall.point_m, by.length), normal=wall.normal) for wall in scene.walls],
        restitution=scene.restitution,
        wall_restitution=scene.wall_restitution,
        gravity_m_s2=vector(scene.gravity_m_s2, by.speed - by.time),
        duration_s=math.ldexp(scene.duration_s, by.time),
        frame_rate_hz=math.ldexp(scene.frame_rate_hz, -by.time),
    )


def gas(seed: int, discs: int = 5, **fields: object) -> Scene:
    """Return unequal discs, one of them immovable, in a box with one oblique wall."""
    rng = random.Random(seed)
    placed: list[Disc] = []
    while len(placed) < discs:
        x, y, r = rng.uniform(0.7, 7.3), rng.uniform(0.7, 7.3), rng.uniform(0.2, 0.6)
        if x + y < 2.5 or any(math.dist((x, y), d.position_m) < r + d.radius_m for d in placed):
            continue
        fixed = len(placed) == 0 and "gravity_m_s2" not in fields
        velocity = (0.0, 0.0) if fixed else (rng.gauss(0, 1), rng.gauss(0, 1))
        mass = math.inf if fixed else rng.uniform(0.5, 3.0)
        placed.append(Disc(position_m=(x, y), velocity_m_s=velocity, radius_m=r, mass_kg=mass))
    sides = (((0, 0), (1, 0)), ((8, 0), (-1, 0)), ((0, 0), (0, 1)), ((0, 8), (0, -1)), ((1, 0.5), (1, 1)))
    walls = [Wall(point_m=point, normal=normal) for point, normal in sides]
    return Scene(name="gas", discs=placed, walls=walls, duration_s=6.0, frame_rate_hz=32.0, **fields)


SCENES = {
    "two discs": Scene(
        name="two",
        discs=[
            Disc(position_m=(0.0, 0.0), radius_m=1.0),
            Disc(position_m=(3.0, 1.0), velocity_m_s=(-1.0, 0.25), radius_m=1.0, mass_kg=2.0),
        ],
        duration_s=10.0,
    ),
    "gas": gas(1),
    "inelastic gas": gas(2, restitution=0.5, wall_restitution=0.75),
    "falling": gas(3, discs=3, gravity_m_s2=(0.0, -1.0), wall_restitution=0.875),
}
SOLVERS: dict[str, Callable[[Scene], Trace]] = {"pic": solve_pic, "framewise": solve_pic_framewise, "pit": solve_pit}


def assert_same_bits(plain: Trace, big: Trace, by: Powers) -> None:
    """Assert that two traces differ in exponents only, and these as they must."""
    assert big.outcome == plain.outcome
    assert big.ambiguous == plain.ambiguous
    assert big.end_time_s == math.ldexp(plain.end_time_s, by.time)
    assert big.dt_s == math.ldexp(plain.dt_s, by.time)
    for name in ("first", "second", "normal"):
        assert np.array_equal(big.impacts[name], plain.impacts[name])
    assert np.array_equal(big.impacts["time_s"], np.ldexp(plain.impacts["time_s"], by.time))
    for name in plain.impacts.dtype.names or ():
        if name.startswith("velocity"):
            assert np.array_equal(big.impacts[name], np.ldexp(plain.impacts[name], by.speed))
    assert np.array_equal(big.final_position_m, np.ldexp(plain.final_position_m, by.length))
    assert np.array_equal(big.final_velocity_m_s, np.ldexp(plain.final_velocity_m_s, by.speed))
    if plain.samples is not None:
        assert big.samples is not None
        assert np.array_equal(big.samples.time_s, np.ldexp(plain.samples.time_s, by.time))
        assert np.array_equal(big.samples.position_m, np.ldexp(plain.samples.position_m, by.length))


powers = st.integers(-MOST, MOST)
#: Lengths and speeds change the unit of time too; it stays within the limits if each goes half the way.
changes = st.one_of(
    powers.map(lambda k: Powers(length=k)),  # speeds with them
    powers.map(lambda k: Powers(time=k)),  # speeds against them
    powers.map(lambda k: Powers(length=k, time=k)),  # speeds stay
    powers.map(lambda k: Powers(mass=k)),
    st.tuples(*[st.integers(-MOST // 2, MOST // 2)] * 2, powers).map(lambda k: Powers(*k)),
)


@pytest.mark.parametrize("name", SCENES)
@pytest.mark.parametrize("solver", SOLVERS)
@given(by=changes)
@example(Powers(length=MOST))
@example(Powers(length=-MOST))
@example(Powers(time=MOST))
@example(Powers(time=-MOST))
@example(Powers(length=196))
@example(Powers(length=201))
@example(Powers(time=-199))
@example(Powers(time=200))
def test_scaling_by_powers_of_two_changes_no_bit(name: str, solver: str, by: Powers) -> None:
    """All of a trace is scaled exactly, whichever method, from 2^-500 to 2^500 in lengths, times, speeds and masses."""
    scene = SCENES[name]
    if scene.gravity_m_s2 != (0.0, 0.0) and abs(by.speed - by.time) > MOST:  # an acceleration has the time squared
        by = Powers(by.length // 3, by.time // 3, by.mass)
    solve = SOLVERS[solver]
    plain = solve(scene)
    assert len(plain.impacts) > 0
    assert_same_bits(plain, solve(scaled(scene, by)), by)
