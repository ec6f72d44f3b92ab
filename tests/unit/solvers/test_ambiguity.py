"""Resolution of impacts, ambiguous impacts, and the limit of impacts at one instant."""

from __future__ import annotations

import math
import random
from typing import NamedTuple

import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.cases import each
from tests.scene_builders import disc_at, staged, wall_at

from carom import Ring, solve_pic
from carom.core.resolution import clock_resolution, gap_resolution
from carom.solvers.event_driven.run import compute_standstill_limit

core_functions = pytest.importorskip("tests.core_functions")


class Blow(NamedTuple):
    """An impact of a disc: its time, the resolution of that, and its normal."""

    time_s: float
    resolution_s: float
    nx: float
    ny: float

    def interferes(self, earlier: Blow) -> bool:
        """Return whether this may be simultaneous with an earlier one that changes its result."""
        is_one_instant = self.time_s - self.resolution_s <= earlier.time_s + earlier.resolution_s
        return is_one_instant and self.nx * earlier.nx + self.ny * earlier.ny != 0.0


#: Impacts at 1 s, of which the second is known to a quarter of a second.
AT_ONE, WIDE = Blow(1.0, 0.0, 1.0, 0.0), Blow(1.0, 0.25, 1.0, 0.0)


def find_ambiguous(blows: list[Blow]) -> list[bool]:
    return list(map(bool, core_functions.ambiguous(blows)))


@each(
    "blows, ambiguous",
    [
        pytest.param([Blow(float(k), 0.0, 1.0, 0.0) for k in range(5)], [], id="five at different times"),
        pytest.param([AT_ONE, Blow(1.0, 0.0, 0.6, 0.8)], [1], id="two at one instant"),
        pytest.param([AT_ONE, Blow(1.0, 0.0, 0.0, 1.0)], [], id="at right angles neither changes the other"),
        pytest.param([AT_ONE, Blow(1.0, 0.0, 0.0, 1.0), Blow(1.0, 0.0, -1.0, 0.0)], [2], id="the first of three"),
        pytest.param([Blow(1.0, 0.0, math.nan, math.nan), AT_ONE], [1], id="friction has no direction"),
        pytest.param([WIDE, Blow(1.375, 0.125, 0.6, 0.8)], [1], id="as far apart as both resolutions"),
        pytest.param([WIDE, Blow(1.5, 0.125, 0.6, 0.8)], [], id="further apart than both resolutions"),
    ],
)
def test_simultaneous_impacts_that_interfere_are_ambiguous(blows: list[Blow], ambiguous: list[int]) -> None:
    """An impact is ambiguous if an earlier one, no further away than their resolutions, changes its result."""
    assert [k for k, is_ambiguous in enumerate(find_ambiguous(blows)) if is_ambiguous] == ambiguous


DIRECTIONS = [(1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.6, 0.8), (-0.8, 0.6), (0.8, 0.6)]


def test_two_stored_impacts_suffice_to_find_ambiguity() -> None:
    """For 400 sequences of twelve impacts the core finds the ambiguities of a comparison with all of them."""
    # A rule that stores the two latest impacts fails in a tenth of them.
    for seed in range(400):
        rng, time_s, blows = random.Random(seed), 0.0, list[Blow]()
        for _ in range(12):
            time_s += rng.randint(0, 3)
            resolution_s = float(rng.randint(0, 6)) if seed % 2 else rng.choice([0.0, 0.5, 1.0, 4.0, math.inf])
            blows.append(Blow(time_s, resolution_s, *rng.choice(DIRECTIONS)))
        by_definition = [any(one.interferes(earlier) for earlier in blows[:k]) for k, one in enumerate(blows)]
        assert find_ambiguous(blows) == by_definition, seed


def test_impacts_sharing_only_an_immovable_disc_are_unambiguous() -> None:
    """Two discs that hit an immovable one at the same time are not ambiguous."""
    discs = [disc_at(-3.0, 0, 1.0, 0.0, r=1), disc_at(0.0, 0, r=1, m=math.inf), disc_at(1.8, 2.4, -0.6, -0.8, r=1)]
    trace = solve_pic(staged("hub", *discs, wall_at(0, -50, 0, 1), duration_s=2))
    assert len(trace.impacts) == 2
    assert trace.ambiguous == ()


def test_standstill_limit_allows_all_finite_sequences() -> None:
    """The limit of impacts at one instant is at least n (n - 1)/2 for n bodies, and 314 for three."""
    # Equal discs in a line have n (n - 1)/2 impacts at one instant; masses 1:10,000 at a wall have 314 (Galperin). The
    # limit is at most 100 n^2 and n^2/2 + 10,000,000.
    assert compute_standstill_limit(3) >= 314
    for bodies in (2, 3, 10, 316, 317, 1000, 10_000, 1_000_000):
        allowed = compute_standstill_limit(bodies)
        assert bodies * (bodies - 1) // 2 <= allowed <= min(100 * bodies**2, bodies**2 // 2 + 10_000_000)


# Resolution -----------------------------------------------------------------------------------------------------------


sizes = st.floats(1e-150, 1e150)
speeds = st.one_of(st.just(0.0), st.floats(-1e100, 1e100), st.floats(1e-30, 1e-10))


@given(sizes, sizes, speeds, speeds, speeds, st.floats(0, 1e12))
def test_core_resolutions_equal_their_definitions_to_the_bit(
    size: float, reach: float, ux: float, uy: float, w: float, time: float
) -> None:
    """The core's pair, wall and clock resolutions have the bits of their definitions."""
    error, fast = gap_resolution(size), math.sqrt(ux * ux + uy * uy)
    graze = reach * math.sqrt(2.0 * (error / reach)) / fast if fast > 0.0 else math.inf
    wall = error / w if w > 0.0 else math.inf
    assert core_functions.resolutions(size, reach, ux, uy, w, time) == (min(wall, graze), wall, clock_resolution(time))


def test_resolution_of_a_graze_is_half_its_overlap_time() -> None:
    """A graze of depth h has a resolution of sqrt(2 R h) / u, half the time of its overlap, for any R and u."""
    for reach, speed in ((2.0, 3.0), (2.0**-300, 2.0**300), (2.0**300, 2.0**-300)):
        h = 5 * 2.0**-52 * (4 * reach)
        expected = math.sqrt(2.0) * math.sqrt(h / reach) * (reach / speed)
        found, _, _ = core_functions.resolutions(4 * reach, reach, 0.0, speed, 0.0, 0.0)
        assert found == pytest.approx(expected, rel=1e-15)


def test_order_that_one_unit_of_a_thick_wall_reverses_is_ambiguous() -> None:
    r"""If one unit in the last place of a wall's centre decides which impact is first, one impact is ambiguous.

    A disc reaches a small ring, whose wall is 1 m thick, and another disc reaches the first one 2^-54 s later.
    """
    small, gap, first = 2.0**-20, 2.0**-10, []
    for centre in (-1.0, math.nextafter(-1.0, -2.0)):
        ring = Ring(centre_m=(centre, 0.0), radius_m=small, half_width_m=1.0 - small)
        slow = disc_at(small + gap, 0.0, -1.0, r=small)
        fast = disc_at(3.0 * small + 2.0 * gap + 2.0**-54, 0.0, -2.0, r=small)
        trace = solve_pic(staged("late", slow, fast, ring, duration_s=2.0 * gap))
        first.append(int(trace.impacts["second"][0]))
        assert 1 in trace.ambiguous
    assert first == [-1, 1]
