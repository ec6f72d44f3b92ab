"""Finite walls against known answers: the group `tables`, wedges, long orbits and growth of errors, to 1e-12.

The answers are theorems, or rational arithmetic here, and independent of the code under test.
"""

import cmath
import math

import numpy as np
import pytest
from tests.cases import each
from tests.scene_builders import disc_at, staged

from carom import Chain, Ring, solve_pic


def build_wedge(degrees: float, side: float = 1e6) -> Chain:
    """Return a wedge with its corner at the origin and its lower side along x."""
    tip = side * cmath.exp(1j * math.radians(degrees))
    return Chain(points_m=[(side, 0.0), (0.0, 0.0), (tip.real, tip.imag)])


def count_wedge_impacts(degrees: float, place: complex, velocity: complex, restitution: float, most: int) -> int:
    """Return the number of impacts of a disc in a wedge.

    `place` is relative to the apex of the wedge in which the centre moves.
    """
    radius = 0.01
    start = place + radius * complex(1.0 / math.tan(math.radians(degrees) / 2.0), 1.0)
    disc = disc_at(*_pair(start), *_pair(velocity), r=radius)
    scene = staged("wedge", disc, build_wedge(degrees), wall_restitution=restitution, duration_s=1e60)
    return len(solve_pic(scene, max_impacts=most).impacts)


@each("degrees", [17, 30, 45, 77, 110])
def test_number_of_impacts_in_a_wedge_matches_unfolding(degrees: int) -> None:
    """The number of impacts in a wedge is the number of its images that the unfolded path crosses."""
    draw = np.random.default_rng(degrees)
    angle = math.radians(degrees)
    for _ in range(8):
        place = draw.uniform(1, 50) * cmath.exp(1j * draw.uniform(0.05, 0.95) * angle)
        velocity = cmath.exp(1j * draw.uniform(-math.pi, math.pi))
        # The path ends in its direction: it turns by less than pi from where it begins.
        turned = cmath.phase(place) + math.remainder(cmath.phase(velocity) - cmath.phase(place), math.tau)
        assert count_wedge_impacts(degrees, place, velocity, 1.0, 100) == abs(math.floor(turned / angle))


@each("degrees", [60, 45, 30])
def test_wedge_with_losses_collapses_below_the_critical_restitution(degrees: int) -> None:
    """Impacts in a wedge have no end if and only if cos(a) >= 2 sqrt(e)/(1 + e)."""
    # With R = 1 - (1 + e) n n^T of each side, the trace of the product is (1 + e)^2 cos^2(a) - 2 e, its determinant
    # e^2: below that restitution its eigenvalues are real. At 60 degrees e is 7 - 4 sqrt(3), that of three discs on a
    # line (McNamara & Young, Phys. Fluids A 4 (1992) 496).
    cosine = math.cos(math.radians(degrees))
    root = (1.0 - math.sqrt(1.0 - cosine**2)) / cosine  # of cos(a) (1 + x^2) = 2 x, with x^2 = e
    critical = root**2
    if degrees == 60:
        assert critical == pytest.approx(7 - 4 * math.sqrt(3), abs=1e-15)
    angle = math.radians(degrees)
    starts = [cmath.exp(1j * angle * part) for part in (0.2, 0.5, 0.8)]
    below = [count_wedge_impacts(degrees, place, -place * cmath.exp(0.02j), 0.97 * critical, 100) for place in starts]
    above = [count_wedge_impacts(degrees, place, -place * cmath.exp(0.02j), 1.03 * critical, 100) for place in starts]
    assert below == [100] * 3
    assert max(above) < 40


def _pair(z: complex) -> tuple[float, float]:
    return z.real, z.imag


@each("angle", [math.tau * 2 / 5, math.tau * 31 / 97, 2e-5, 2e-9, 2e-12])
def test_impacts_in_a_circle_are_equal_chords_apart(angle: float) -> None:
    """The k-th impact in a ring comes after k equal chords, also for a path of 1e-12 radians to the wall."""
    disc = disc_at(1.0, 0.0, -math.sin(angle / 2), math.cos(angle / 2), r=0.25)
    scene = staged("star", disc, Ring(centre_m=(0, 0), radius_m=1.25), duration_s=4000.0)
    # A velocity is rounded at each impact, by 1e-16 of it: of a small angle a part, at worst each time the same way.
    impacts, late, rim = (2000, 1e-13, 1e-12) if angle > 1.0 else (500, 1000 * 2.0**-52 / angle, 1e-14)
    trace = solve_pic(scene, max_impacts=impacts)
    times = 2 * math.sin(angle / 2) * np.arange(1, impacts + 1)
    assert np.max(np.abs(trace.impacts["time_s"] / times - 1)) < late
    assert abs(math.hypot(*trace.final_position_m[0]) - 1.0) < rim
    assert trace.ambiguous == ()
    assert trace.counts["epochs"] > 3
