"""How well an instant is known and what is ambiguous, in plain forms and compiled ones, and the log that tells it."""

from __future__ import annotations

import math
import random
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.stage import disc_at, staged, wall_at

from carom.solvers.impact.resolution import clock_resolution, pair_resolution, size_of, wall_resolution
from carom.solvers.impact_log import ImpactLog, Recent, standstill_impacts
from carom.trace import ImpactRecord, Vector, wall_body

REST = (0.0, 0.0)


def log(*, immovable: tuple[int, ...] = (), discs: int = 4) -> ImpactLog:
    """Return an empty log of a scene of so many discs and one wall."""
    return ImpactLog(
        staged(
            "log",
            *[disc_at(3.0 * i, 0, r=1, m=math.inf if i in immovable else 1.0) for i in range(discs)],
            wall_at(0, -5, 0, 1),
            duration_s=1,
        )
    )


def impact(time_s: float, first: int, second: int, normal: Vector = (1.0, 0.0)) -> ImpactRecord:
    """Return a record of which only time, bodies and normal matter."""
    return ImpactRecord(time_s, first, second, normal, REST, REST, REST, REST)


def test_impacts_at_different_instants_are_unique() -> None:
    """One disc may collide as often as it likes, one after the other."""
    kept = log()
    for k, (first, second) in enumerate([(0, 1), (1, 2), (0, 1)]):
        kept.add(impact(float(k), first, second))
    assert list(kept.ambiguous()) == []
    assert [record.time_s for record in kept.records] == [0.0, 1.0, 2.0]


@pytest.mark.parametrize(
    ("impacts", "ambiguous"),
    [
        pytest.param([(0, 1), (2, 3)], [], id="no disc in common"),
        pytest.param([(0, 1), (1, 2, (0.6, 0.8))], [1], id="a movable disc in common"),
        pytest.param([(0, 1, (0.6, 0.8)), (0, 2, (-0.8, 0.6))], [], id="at right angles neither changes the other"),
        pytest.param([(0, 1), (0, 2, (0.0, 1.0)), (0, 3, (-1.0, 0.0))], [2], id="the first of three counts as well"),
    ],
)
def test_impacts_that_share_a_movable_disc_at_one_instant_are_ambiguous(
    impacts: list[tuple[Any, ...]], ambiguous: list[int]
) -> None:
    """Of simultaneous impacts those are flagged, by index, that change what an earlier one of the instant sees."""
    kept = log()
    kept.add(impact(0.5, 0, 3))
    for bodies in impacts:
        kept.add(impact(1.0, *bodies))
    assert list(kept.ambiguous()) == [1 + index for index in ambiguous]


def test_instants_within_their_resolution_are_one() -> None:
    """Impacts apart by no more than both times are uncertain share an instant; further apart they do not."""
    for gap, ambiguous in ((0.375, [1]), (0.5, [])):
        kept = log()
        kept.add(impact(1.0, 0, 1), 0.25)
        kept.add(impact(1.0 + gap, 0, 2, (0.6, 0.8)), 0.125)
        assert list(kept.ambiguous()) == ambiguous


directions = st.sampled_from([(1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.6, 0.8), (-0.8, 0.6), (0.8, 0.6)])
struck = st.tuples(st.integers(0, 3), st.integers(0, 3), directions)


@given(st.lists(struck, max_size=12))
def test_what_is_flagged_is_what_comparing_with_every_earlier_impact_flags(
    blows: list[tuple[int, int, Vector]],
) -> None:
    """The log keeps no more than two impacts of a disc, and flags what keeping all of them would flag."""
    kept = log()
    time_s, history, flagged = 0, list[tuple[int, int, Vector]](), []
    for index, (later, resolution, normal) in enumerate(blows):
        time_s += later
        if any(
            time_s - earlier <= resolution + its_resolution and normal[0] * n[0] + normal[1] * n[1] != 0.0
            for earlier, its_resolution, n in history
        ):
            flagged.append(index)
        history.append((time_s, resolution, normal))
        kept.add(impact(float(time_s), 0, wall_body(0), normal), float(resolution))
    assert list(kept.ambiguous()) == flagged


def test_very_many_impacts_at_one_instant_take_no_longer_each() -> None:
    """Twenty thousand impacts of one disc at one instant are logged one as fast as the other."""
    kept = log(discs=2)
    record = impact(1.0, 0, 1)
    for _ in range(20_000):
        kept.add(record)
    assert len(kept.ambiguous()) == 19_999


def test_impacts_that_share_only_an_immovable_disc_or_a_wall_are_unique() -> None:
    """What cannot move passes nothing on from one impact to another."""
    kept = log(immovable=(1,))
    kept.add(impact(1.0, 0, 1))
    kept.add(impact(1.0, 1, 2, (0.6, 0.8)))
    kept.add(impact(2.0, 0, wall_body(0), (0.0, -1.0)))
    kept.add(impact(2.0, 2, wall_body(0), (0.0, -1.0)))
    assert list(kept.ambiguous()) == []


def test_so_many_impacts_at_one_instant_let_through_whatever_ends() -> None:
    """Equal discs in a line have n(n-1)/2 at one instant; masses 1:100 and 1:10,000 at a wall 31 and 314 (Galperin)."""
    assert standstill_impacts(3) >= 314
    for bodies in (2, 3, 10, 316, 317, 1000, 10_000, 1_000_000):
        allowed = standstill_impacts(bodies)
        assert bodies * (bodies - 1) // 2 <= allowed <= min(100 * bodies**2, bodies**2 // 2 + 10_000_000)


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
