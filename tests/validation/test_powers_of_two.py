"""A scene measured in other units is the same scene: scaling by powers of two changes exponents, and no other bit."""

from __future__ import annotations

import math
import random
from collections.abc import Callable
from typing import NamedTuple

import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from tests.rebuilt import assert_scaled, in_units
from tests.stage import disc_at, staged

from carom import Disc, Scene, Trace, Wall, solve_pic, solve_pic_framewise, solve_pit

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
    "two discs": staged("two", disc_at(0.0, 0.0, r=1.0), disc_at(3.0, 1.0, -1.0, 0.25, r=1.0, m=2.0), duration_s=10.0),
    "gas": gas(1),
    "inelastic gas": gas(2, restitution=0.5, wall_restitution=0.75),
    "falling": gas(3, discs=3, gravity_m_s2=(0.0, -1.0), wall_restitution=0.875),
}
SOLVERS: dict[str, Callable[[Scene], Trace]] = {"pic": solve_pic, "framewise": solve_pic_framewise, "pit": solve_pit}


powers = st.integers(-MOST, MOST)
#: Lengths and speeds change the unit of time too; it stays within the limits if each goes half the way.
changes = st.one_of(
    powers.map(lambda k: Powers(length=k)),  # speeds with them
    powers.map(lambda k: Powers(time=k)),  # speeds against them
    powers.map(lambda k: Powers(length=k, time=k)),  # speeds stay
    powers.map(lambda k: Powers(mass=k)),
    st.tuples(*[st.integers(-MOST // 2, MOST // 2)] * 2, powers).map(lambda k: Powers(*k)),
)


@pytest.mark.parametrize(
    ("solver", "name"),
    [
        # A solver that looks every frame takes longest; one scene of each kind has it looked at by default.
        pytest.param(solver, name, marks=[pytest.mark.long] * (solver == "framewise" and name in {"gas", "falling"}))
        for solver in SOLVERS
        for name in SCENES
    ],
)
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
    units = {"length": 2.0**by.length, "time": 2.0**by.time}
    assert_scaled(plain, solve(in_units(scene, **units, mass=2.0**by.mass)), **units)
