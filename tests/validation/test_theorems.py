"""Theorems on collisions, tried on many scenes each; the sources stand in the docstrings."""

from __future__ import annotations

import math

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from tests.lengths import each
from tests.stage import disc_at, staged

from carom import Outcome, Scene, solve_pic


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


@each("e", [0.02, 0.05, 0.07, 0.08, 0.1, 0.2, 0.5, 0.9, 1.0])
def test_three_equal_discs_collapse_below_the_critical_restitution_and_part_above_it(e: float) -> None:
    """Below 7 - 4 sqrt(3) three equal discs in line collide without end, each round closing the gaps further.

    S. McNamara and W. R. Young, Phys. Fluids A 4, 496 (1992). In float64 that ends when the gaps are used up: after
    tens of impacts, with the discs together at one velocity. Above it they part, with speeds in order.
    """
    trace = solve_pic(three_closing(e))
    speeds = trace.final_velocity_m_s[:, 0]
    if e < 7 - 4 * math.sqrt(3):
        assert len(trace.impacts) > 30
        assert np.max(speeds) - np.min(speeds) < 1e-9
    else:
        assert trace.outcome is Outcome.COMPLETED
        assert len(trace.impacts) < 30
        assert np.all(np.diff(speeds) > 0)


def three_closing(e: float) -> Scene:
    """Stage three equal discs in line, the outer two closing on the middle one at rest, one of them later."""
    discs = [disc_at(x, 0.0, v, r=0.25) for x, v in ((-1.5, 1.0), (0.0, 0.0), (1.75, -1.0))]
    return staged("collapse", *discs, restitution=e, duration_s=1000.0)
