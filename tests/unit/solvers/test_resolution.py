"""How well an instant is known, and what is ambiguous: the plain forms and the compiled ones."""

from __future__ import annotations

import math
import random

import pytest
from hypothesis import given
from hypothesis import strategies as st

from carom.solvers.impact.resolution import clock_resolution, pair_resolution, size_of, wall_resolution
from carom.solvers.impact_log import Recent

sizes = st.floats(1e-150, 1e150)
speeds = st.one_of(st.just(0.0), st.floats(-1e100, 1e100), st.floats(1e-30, 1e-10))


@given(sizes, sizes, speeds, speeds, speeds, st.floats(0, 1e12))
def test_both_forms_give_the_same_bits(size: float, reach: float, ux: float, uy: float, w: float, time: float) -> None:
    """The compiled resolutions are those of the plain form, to the bit."""
    probe = pytest.importorskip("tests.probe")
    plain = pair_resolution(size, reach, ux, uy, w), wall_resolution(size, w), clock_resolution(time)
    assert probe.resolutions(size, reach, ux, uy, w, time) == plain


@given(
    st.lists(
        st.tuples(
            st.integers(0, 3),
            st.sampled_from([0.0, 0.5, 1.0, 4.0, math.inf]),
            st.sampled_from([(1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.6, 0.8), (-0.8, 0.6), (0.8, 0.6)]),
        ),
        max_size=12,
    )
)
def test_both_forms_of_the_rule_find_the_same_impacts_ambiguous(
    blows: list[tuple[int, float, tuple[float, float]]],
) -> None:
    """The compiled rule of what is ambiguous is the plain one."""
    probe = pytest.importorskip("tests.probe")
    time, impacts = 0.0, []
    for later, resolution, (nx, ny) in blows:
        time += later
        impacts.append((time, resolution, nx, ny))
    recent = Recent()
    assert probe.ambiguous(impacts) == [recent.add_contact(*impact) for impact in impacts]


def test_the_rule_is_that_of_all_earlier_impacts() -> None:
    """Both forms keep two impacts of a disc, and find what comparing with every earlier one finds.

    In 400 sequences of twelve, a form that keeps the nearer two in place of those that reach furthest fails in a tenth.
    """
    probe = pytest.importorskip("tests.probe")
    normals = [(1.0, 0.0), (0.0, 1.0), (0.6, 0.8), (-0.8, 0.6), (0.8, 0.6)]
    for seed in range(400):
        rng = random.Random(seed)
        impacts = list[tuple[float, float, float, float]]()
        time_s = 0.0
        for _ in range(12):
            time_s += rng.randint(0, 3)
            impacts.append((time_s, float(rng.randint(0, 6)), *rng.choice(normals)))
        expected = [
            any(t - r <= t0 + r0 and nx * nx0 + ny * ny0 != 0.0 for t0, r0, nx0, ny0 in impacts[:k])
            for k, (t, r, nx, ny) in enumerate(impacts)
        ]
        recent = Recent()
        assert [recent.add_contact(*impact) for impact in impacts] == expected, seed
        assert list(map(bool, probe.ambiguous(impacts))) == expected, seed


def test_a_head_on_impact_is_known_to_the_rounding_of_places_over_the_speed() -> None:
    """At 2 m/s, with sizes of 8 m in all, five units in the last place of these are half as many seconds."""
    assert size_of(-2.0, 1.0, 1.0) == 4.0
    assert pair_resolution(8.0, 2.0, 2.0, 0.0, 2.0) == 5 * 8 * 2.0**-52 / 2
    assert wall_resolution(8.0, 2.0) == 5 * 8 * 2.0**-52 / 2


def test_a_graze_is_known_to_half_the_width_of_its_overlap() -> None:
    """With no speed along the normal, an overlap of depth h lasts for 2 sqrt(2 R h) / u, whatever R and u."""
    for reach, speed in ((2.0, 3.0), (2.0**-300, 2.0**300), (2.0**300, 2.0**-300)):
        h = 5 * 2.0**-52 * (4 * reach)
        expected = math.sqrt(2.0) * math.sqrt(h / reach) * (reach / speed)
        assert pair_resolution(4 * reach, reach, 0.0, speed, 0.0) == pytest.approx(expected, rel=1e-15)


def test_what_does_not_approach_is_known_to_no_time() -> None:
    """An impact without any relative speed, and one on a wall without approach, may have been at any time."""
    assert pair_resolution(1.0, 1.0, 0.0, 0.0, 0.0) == math.inf
    assert wall_resolution(1.0, 0.0) == math.inf
