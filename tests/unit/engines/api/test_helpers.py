"""What adapters of several engines share: the order of a pair, the time of counted steps, factored restitutions."""

import math
from dataclasses import replace

import pytest
from tests.cases import each
from tests.scene_builders import disc_at, require_value, staged, wall_at

from carom.engines.api import (
    Capabilities,
    StepClock,
    factored_frictions,
    factored_restitutions,
    flattened,
    is_fast,
    oriented_contact,
    pair_of,
    reach,
    unsupported_reason,
)


@each("a, b, pair", [(2, 5, (2, 5)), (5, 2, (2, 5)), (3, -1, (3, -1)), (-4, 0, (0, -4))])
def test_contact_runs_from_the_lower_disc_to_the_other_body(a: int, b: int, pair: tuple[int, int]) -> None:
    """The disc of the lower number comes first and a wall second, in whichever order an engine names them."""
    assert pair_of(a, b) == pair
    contact = oriented_contact(a, b, 0.25, (0.6, -0.8), 2.0, -0.5)
    assert (contact.first, contact.second) == pair
    assert contact.normal == ((0.6, -0.8) if pair[0] == a else (-0.6, 0.8))
    # What the second receives across the normal, in the scene's directions: exchanged, it receives the opposite.
    nx, ny = contact.normal
    received = (-0.5 * -0.8 * -1, -0.5 * 0.6) if pair[0] == a else (0.5 * -0.8 * -1, 0.5 * 0.6)
    rub = require_value(contact.tangential_impulse_n_s)
    assert (-ny * rub, nx * rub) == received


def test_speed_limits_apply_to_the_fastest_leg() -> None:
    """Limits on speed and on motion per step are compared with the fastest leg of a driven disc."""
    legs = [{"from_s": 0.0, "velocity_m_s": (1.0, 0.0)}, {"from_s": 0.5, "velocity_m_s": (0.0, 30.0)}]
    mallet = disc_at(0, 0, m=math.inf, driven=True, legs=legs)
    scene = staged("mallet", mallet, disc_at(9, 0), duration_s=1.0)
    able = Capabilities(driven_discs=True, legs=True)
    assert unsupported_reason(scene, able, 0.1) == ""
    assert "a disc moves at 30 m/s" in unsupported_reason(scene, replace(able, max_speed_m_s=29.0), 0.1)
    assert "moves 3 m in a step" in unsupported_reason(scene, replace(able, max_move_m=2.0), 0.1)
    assert is_fast(scene.discs[0], 0.02)
    assert not is_fast(scene.discs[0], 0.01)


def test_step_clock_multiplies_steps_instead_of_adding_them() -> None:
    """The time is the number of steps times their length: 1000 steps of 0.1 s end at exactly 100 s."""
    clock = StepClock(0.1)
    for _ in range(1000):
        clock.count(1)
    assert clock.now_s == 100.0
    clock.cut(0.25)
    clock.count(2)
    assert (clock.now_s, clock.step_began_s) == (100.5, 100.25)
    clock.restart(3.0)
    assert clock.now_s == 3.0


@each("pair", [0.0, 0.1, 0.25, 1.0])
@each("wall", [0.0, 0.5, 1.0])
def test_factored_coefficients_multiply_to_those_of_the_scene(pair: float, wall: float) -> None:
    """Disc times disc is the coefficient of a pair and disc times wall that of a wall, even if one is zero."""
    laws = {"restitution": pair, "wall_restitution": wall, "friction": pair, "wall_friction": 3.0 * wall}
    scene = staged("e", disc_at(0, 0), wall_at(9, 0, -1, 0), **laws, duration_s=1.0)
    for (of_disc, of_wall), times in ((factored_restitutions(scene), 1.0), (factored_frictions(scene), 3.0)):
        assert of_disc * of_disc == pytest.approx(pair, rel=1e-15)
        assert of_disc * of_wall == pytest.approx(times * wall, rel=1e-15)


def test_reach_includes_rotational_energy() -> None:
    """Friction can set a spinning disc in motion, so `reach` counts the energy of rotation."""
    bodies = disc_at(0.0, 1.0, r=1.0, spin_rad_s=6.0), wall_at(0.0, 0.0, 0.0, 1.0)
    scene = staged("top", *bodies, wall_friction=1.0, duration_s=10.0)
    # m v^2 / 2 = k m (R w)^2 / 2 at most, with k = 1/2.
    assert reach(scene, 0.0)[1] == pytest.approx(1.0 + 6.0 * math.sqrt(0.5) * 10.0, rel=1e-15)


def test_impulse_out_of_the_plane_is_projected() -> None:
    """An impulse of 10 N s along (0.48, 0.64, 0.6) becomes 8 N s along (0.6, 0.8); one along z becomes 0."""
    normal, impulse = flattened((0.48, 0.64), 10.0)
    assert normal == pytest.approx((0.6, 0.8), abs=1e-15)
    assert impulse == pytest.approx(8.0, abs=1e-14)
    assert flattened((0.0, 0.0), 10.0)[1] == 0.0
