"""The log of impacts: which have no unique answer, and when time stands still."""

from __future__ import annotations

import math
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.stage import disc_at, staged, wall_at

from carom.solvers.impact_log import ImpactLog, standstill_impacts
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
