"""Theorems on collisions, tried on many scenes each; the sources stand in the docstrings."""

from __future__ import annotations

import math
from itertools import combinations, pairwise

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from tests.stage import disc_at, staged, wall_at

from carom import Outcome, Scene, solve_pic, solve_pic_framewise

ROUNDING = 1e-12


def galperin(mass_ratio: float, gap_light: float, gap_heavy: float, speed: float, duration_s: float) -> Scene:
    """Stage a light disc at rest between a wall and a heavy one that comes on; gaps exclude radii."""
    radius = 0.1
    return staged(
        "galperin",
        disc_at(gap_light + radius, 0.0, r=radius),
        disc_at(gap_heavy + 3 * radius, 0.0, -speed, 0.0, r=radius, m=mass_ratio),
        wall_at(0.0, 0.0, 1.0, 0.0),
        duration_s=duration_s,
    )


@given(st.floats(1, 2000), st.floats(0.1, 1), st.floats(1.01, 2), st.floats(0.5, 4))
def test_galperin_impacts_come_at_cotangents(mass_ratio: float, x: float, further: float, speed: float) -> None:
    """For any mass ratio M the n-th impact is at (X - x cot(n theta) / sqrt(M)) / V with theta = atan(1 / sqrt(M)).

    There are ceil(pi / theta) - 1 of them. Both follow from unfolding: a straight line crosses the rays n theta.
    """
    big_x = x * further
    theta = math.atan(1 / math.sqrt(mass_ratio))
    count = math.ceil(math.pi / theta) - 1
    # A last ray almost along the path is crossed after any time, or just not.
    assume(min(math.pi - count * theta, (count + 1) * theta - math.pi) > 1e-3 * theta)
    ray = np.arange(1, count + 1) * theta
    across = x / (math.sqrt(mass_ratio) * speed)
    times = big_x / speed - across / np.tan(ray)
    trace = solve_pic(galperin(mass_ratio, x, big_x, speed, duration_s=2 * times[-1]))
    assert len(trace.impacts) == count
    # Each impact turns the path by some tens of roundings more, and to turn the path by an angle is to turn the ray:
    # the derivative of the cotangent says what that does to the time.
    roundings = 64 * np.arange(1, count + 1) * 2.0**-53
    assert np.all(np.abs(trace.impacts["time_s"] - times) <= roundings * (times + across / np.sin(ray) ** 2))


@given(
    st.lists(st.integers(-40, 40), min_size=2, max_size=7, unique=True),
    st.lists(st.floats(0.05, 1), min_size=6, max_size=6),
    st.floats(0.05, 0.5),
)
def test_equal_masses_sort_their_velocities(velocities: list[int], gaps: list[float], radius: float) -> None:
    """Equal masses on a line: as many impacts as inversions, velocities end sorted, positions are the sorted ghosts.

    D. W. Jepsen, J. Math. Phys. 6, 405 (1965): an impact exchanges velocities, so velocities walk on as ghosts.
    """
    ghosts = np.concatenate([[0.0], np.cumsum(gaps)])[: len(velocities)]
    speeds = np.array(velocities) / 8
    crossings = [
        (ghosts[b] - ghosts[a]) / (speeds[a] - speeds[b])
        for a, b in combinations(range(len(ghosts)), 2)
        if speeds[a] > speeds[b]
    ]
    crossings.sort()
    # Three ghosts at one place are three discs in one impact, which has no unique order.
    assume(all(later - earlier > 1e-6 for earlier, later in pairwise(crossings)))
    duration = 1.5 * crossings[-1] if crossings else 1.0
    discs = [disc_at(g + 2 * radius * k, 0.0, v, r=radius) for k, (g, v) in enumerate(zip(ghosts, speeds, strict=True))]
    trace = solve_pic(staged("sorting", *discs, duration_s=duration))
    assert len(trace.impacts) == len(crossings)
    # The least relative speed is 1/8, so a rounding of a position moves an instant by at most 8 times as much.
    extent = float(np.max(np.abs(ghosts)) + 2 * radius * len(ghosts) + np.max(np.abs(speeds)) * duration)
    assert trace.impacts["time_s"] == pytest.approx(crossings, abs=8 * ROUNDING * extent)
    assert trace.final_velocity_m_s[:, 0] == pytest.approx(np.sort(speeds), abs=ROUNDING)
    expected = np.sort(ghosts + speeds * duration) + 2 * radius * np.arange(len(ghosts))
    assert trace.final_position_m[:, 0] == pytest.approx(expected, abs=8 * ROUNDING * extent)


@given(
    st.tuples(*[st.floats(0.05, 20)] * 3),
    st.tuples(*[st.floats(-3, 3)] * 3),
    st.tuples(st.floats(0.01, 2), st.floats(0.01, 2)),
)
def test_three_masses_on_a_line_collide_a_bounded_number_of_times(
    masses: tuple[float, ...], speeds: tuple[float, ...], gaps: tuple[float, ...]
) -> None:
    """However three masses start, they collide at most ceil(pi / acos sqrt(m1 m3 / ((m1 + m2)(m2 + m3)))) times.

    Unfolding of the wedge of that angle; S. Tabachnikov, Geometry and Billiards (2005).
    """
    m1, m2, m3 = masses
    angle = math.acos(math.sqrt(m1 * m3 / ((m1 + m2) * (m2 + m3))))
    x = np.cumsum([0.0, gaps[0] + 0.2, gaps[1] + 0.2])
    discs = [disc_at(p, 0.0, v, r=0.1, m=m) for p, v, m in zip(x, speeds, masses, strict=True)]
    trace = solve_pic(staged("three", *discs, duration_s=1e6))
    assert len(trace.impacts) <= math.ceil(math.pi / angle)


@given(st.floats(-0.999, 0.999))
def test_an_immovable_disc_deflects_by_pi_less_twice_the_arcsine(offset: float) -> None:
    """The angle of deflection is pi - 2 asin(b / R) (Landau and Lifshitz, Mechanics, section 18, problem 1)."""
    contact = 0.75
    discs = [disc_at(-2.0, -offset * contact, 3.0, 0.0, r=0.25), disc_at(0.0, 0.0, m=math.inf)]
    trace = solve_pic(staged("deflection", *discs, duration_s=1.0))
    vx, vy = trace.final_velocity_m_s[0]
    deflection = math.pi - 2 * math.asin(abs(offset))
    # Near a graze the angle is the square root of the distance from it: its rounding grows as 1 / cos.
    assert math.atan2(abs(vy), vx) == pytest.approx(deflection, abs=1e-14 / math.sqrt(1 - offset**2))
    assert vy * offset <= 0


@given(st.floats(0.5, 1), st.integers(2, 12))
def test_crossings_between_walls_grow_geometrically(e: float, count: int) -> None:
    """Between two walls of restitution e each crossing takes 1/e times as long as the one before."""
    width, radius, speed = 2.0, 0.25, 4.0
    crossing = (width - 2 * radius) / speed
    end = (width / 2 - radius) / speed + sum(crossing * e**-n for n in range(1, count))
    scene = staged(
        "ladder",
        disc_at(0.0, 0.0, speed, 0.0, r=radius),
        *[wall_at(x, 0.0, -x, 0.0) for x in (-width / 2, width / 2)],
        wall_restitution=e,
        duration_s=end + crossing / 2,
    )
    trace = solve_pic(scene)
    assert len(trace.impacts) == count
    crossings = np.diff(trace.impacts["time_s"])
    assert crossings == pytest.approx(crossing * e ** -np.arange(1.0, count), abs=ROUNDING * end)


@pytest.mark.parametrize("free_path", [0.5, 1.0, 2.0])
def test_the_orbit_between_two_fixed_discs_is_unstable_at_the_known_rate(free_path: float) -> None:
    """A small offset from the axis grows by (1 + L/R) + sqrt((1 + L/R)^2 - 1) a bounce.

    Derivation: over a free path L an offset y and a slope s become y + L s; a bounce off a disc of contact radius R
    adds 2 y / R to the slope. The product of the two matrices has determinant 1 and trace 2 + 2 L / R, and the greater
    eigenvalue is the rate; after a few bounces nothing but its own direction is left.
    """
    radius, contact = 0.25, 1.0
    half = free_path / 2 + contact
    fixed = [disc_at(x, 0.0, r=contact - radius, m=math.inf) for x in (-half, half)]
    moving = disc_at(0.0, 2.0**-40, 1.0, r=radius)
    bounces = 6
    scene = staged("bounce", *fixed, moving, duration_s=bounces * free_path)
    impacts = solve_pic(scene).impacts
    assert len(impacts) == bounces
    offsets = np.abs(impacts["normal"][:, 1]) * contact
    rate = 1 + free_path / contact + math.sqrt((1 + free_path / contact) ** 2 - 1)
    # The other eigenvalue is 1 / rate, so its share has shrunk by rate^2 at each of the bounces before.
    share_left = rate ** (-2.0 * (bounces - 2))
    assert offsets[-1] / offsets[-2] == pytest.approx(rate, rel=4 * share_left)


@pytest.mark.parametrize("e", [0.02, 0.05, 0.07])
def test_three_equal_discs_collapse_below_the_critical_restitution(e: float) -> None:
    """Below 7 - 4 sqrt(3) three equal discs in line collide without end, each round closing the gaps further.

    S. McNamara and W. R. Young, Phys. Fluids A 4, 496 (1992). In float64 that ends when the gaps are used up: after
    tens of impacts, with the discs together at one velocity.
    """
    assert e < 7 - 4 * math.sqrt(3)
    trace = solve_pic(three_closing(e))
    assert len(trace.impacts) > 30
    speeds = trace.final_velocity_m_s[:, 0]
    assert np.max(speeds) - np.min(speeds) < 1e-9


@pytest.mark.parametrize("e", [0.08, 0.1, 0.2, 0.5, 0.9, 1.0])
def test_three_equal_discs_part_above_the_critical_restitution(e: float) -> None:
    """Above 7 - 4 sqrt(3) the same three discs part after finitely many impacts, with speeds in order."""
    assert e > 7 - 4 * math.sqrt(3)
    trace = solve_pic(three_closing(e))
    assert trace.outcome is Outcome.COMPLETED
    assert len(trace.impacts) < 30
    assert np.all(np.diff(trace.final_velocity_m_s[:, 0]) > 0)


def three_closing(e: float) -> Scene:
    """Stage three equal discs in line, the outer two closing on the middle one at rest, one of them later."""
    discs = [disc_at(x, 0.0, v, r=0.25) for x, v in ((-1.5, 1.0), (0.0, 0.0), (1.75, -1.0))]
    return staged("collapse", *discs, restitution=e, duration_s=1000.0)


def test_pic_framewise_counts_as_pic_does() -> None:
    """Algorithm 2 makes Galperin's 314 impacts too, dozens of them in one frame."""
    scene = galperin(1e4, 0.5, 1.0, 1.0, duration_s=4.0)
    event_driven, framewise = solve_pic(scene), solve_pic_framewise(scene)
    assert framewise.impacts.tobytes() == event_driven.impacts.tobytes()
    frames = np.floor(framewise.impacts["time_s"] * scene.frame_rate_hz)
    assert np.max(np.unique(frames, return_counts=True)[1]) > 24
