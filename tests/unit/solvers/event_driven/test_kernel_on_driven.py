"""The kernel where something is driven: ties, legs and crushes; random tables: see test_equivalences."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from tests.drawn import table
from tests.lengths import each, long_after
from tests.stage import disc_at, staged, wall_at
from tests.unit.solvers.kinds import assert_same

from carom import Chain, Disc, Outcome, Scene, Wall
from carom.solvers.event_driven.run import EventDrivenRun
from carom.solvers.plain.bodies import Bodies
from carom.solvers.plain.run import AllPairsRun
from carom.solvers.plain.squeeze import Squeezes

pytest.importorskip("carom.core.pic")

#: That of state.h.
NO_BODY = -(2**31)


def legs(*parts: tuple[float, float]) -> list[dict[str, Any]]:
    """Return legs along x: when each begins, and its speed."""
    return [{"from_s": begin, "velocity_m_s": (speed, 0.0)} for begin, speed in parts]


_HELD: dict[str, Any] = {"radius_m": 0.25, "mass_kg": math.inf, "driven": True}


def mallet(x: float, y: float, speed: float) -> Disc:
    """Return a disc of radius 1/4 that is driven along x."""
    return Disc(position_m=(x, y), velocity_m_s=(speed, 0.0), **_HELD)


PUCK = disc_at(0.0, 0.0, 1.0, r=0.25)
#: What meets a puck at one instant, to the bit; and how often it is struck in two seconds.
AT_ONCE: dict[str, tuple[list[Disc], list[Any], int]] = {
    "both edges of a corner": ([PUCK], [Chain(points_m=[(2, -2), (4, 0), (2, 2)], velocity_m_s=(-1.0, 0.0))], 2),
    "an edge as it turns back": ([PUCK], [Chain(points_m=[(2.25, -1), (2.25, 1)], legs=legs((0, -1), (1, 1)))], 0),
    "an edge as it turns to come": ([PUCK], [Chain(points_m=[(1.25, -1), (1.25, 1)], legs=legs((0, 0), (1, -1)))], 1),
    "a wall, and one that sets out then": (
        [PUCK.model_copy(update={"velocity_m_s": (1.0, 1.0)})],
        [
            Chain(points_m=[(-3, 1.25), (3, 1.25)]),
            Chain(points_m=[(1.25, -3), (1.25, 3)], legs=legs((0, 0), (1, -1))),
        ],
        2,
    ),
    "a mallet that is disc 0": ([mallet(1.5, 0.0, -0.5), PUCK], [], 1),
    "two mallets": ([PUCK, mallet(1.0, 0.375, -1.0), mallet(1.0, -0.375, -1.0)], [], 2),
    "a disc and a mallet": (
        [PUCK, disc_at(1.0, 0.375, -1.0, r=0.25), mallet(1.0, -0.375, -1.0)],
        [],
        2,
    ),
    "a mallet as it turns back": ([PUCK, Disc(position_m=(2.5, 0), **_HELD, legs=legs((0, -1), (1, 1)))], [], 0),
    "a mallet that turns to come": ([PUCK, Disc(position_m=(1.5, 0), **_HELD, legs=legs((0, 0), (1, -1)))], [], 1),
}


@each("name", AT_ONCE)
def test_what_happens_at_one_instant_has_the_order_of_all_pairs(name: str) -> None:
    """Ties of features, walls, discs and mallets, and impacts at the very instant at which a leg begins."""
    discs, walls, impacts = AT_ONCE[name]
    plain = assert_same(staged("at once", *discs, *walls, duration_s=2.0))
    assert plain.impacts == impacts


def row(discs: int, gap: float, speed: float) -> Scene:
    """Return discs in a row between a wall and one that comes, at the head of a mallet."""
    places = [gap + (1.0 + gap) * k for k in range(discs)]
    free = [disc_at(0.5 + x, 0.0, 0.25 * (-1) ** k) for k, x in enumerate(places)]
    return staged("row", *free, mallet(places[-1] + 1.75 + gap, 0.0, -speed), wall_at(0, 0, 1, 0), duration_s=20.0)


def pinched(half: float) -> Scene:
    """Return a disc that goes sideways between an edge and one that comes, each of this half length."""
    edge = Chain(points_m=[(-half, 0), (half, 0)])
    piston = Chain(points_m=[(-half, 2), (half, 2)], velocity_m_s=(0.0, -0.25))
    disc = disc_at(0.0, 1.0, 0.125, 0.5, r=0.25)
    return staged("pinched", disc, edge, piston, duration_s=20.0)


@pytest.mark.parametrize(("half", "outcome"), [(3.0, Outcome.CRUSHED), (0.5, Outcome.COMPLETED)])
def test_a_disc_between_edges_is_crushed_at_the_same_impact(half: float, outcome: Outcome) -> None:
    """Or gets out sideways, where they are too short."""
    assert_same(pinched(half), 10**6)
    assert EventDrivenRun(pinched(half)).advance_to(20.0) is outcome


@pytest.mark.parametrize("discs", [1, *long_after(0, [2, 3])])
def test_a_row_is_crushed_at_the_same_impact(discs: int) -> None:
    """By a mallet and a wall, of one disc and of more in a row: the kernel tells of it when the all-pairs run does."""
    assert assert_same(row(discs, 0.25, 0.125), 10**6).notes


def test_how_discs_go_to_and_fro_is_told_alike(monkeypatch: pytest.MonkeyPatch) -> None:
    """Whom each has struck last, whom on the other side, along which normal, and how often in a row."""
    kept: list[Squeezes] = []

    def squeezes(bodies: Bodies, most: int) -> Squeezes:
        kept.append(Squeezes(bodies, most))
        return kept[-1]

    monkeypatch.setattr("carom.solvers.plain.run.Squeezes", squeezes)
    longest = 0
    for scene in (
        row(2, 0.25, 0.125),
        pinched(3.0),
        *(table("driven table", k) for k in range(4)),
    ):
        if not scene.arrays.driven_discs and scene.arrays.wall_drives is None:
            continue
        plain, compiled = AllPairsRun(scene), EventDrivenRun(scene)
        for run in (plain, compiled):
            run.advance_to(scene.duration_s, 60)
        found = compiled.state().kernel["to_and_fro"]
        for disc, told in enumerate(kept[-1].to_and_fro):
            last, across = (NO_BODY if struck is None else struck.body for struck in (told.last, told.across))
            expected = (last, *told.normal, across, told.row)
            assert tuple(found[["last", "nx", "ny", "across", "row"]][disc]) == expected
            longest = max(longest, told.row)
    assert longest > 20


def test_a_leg_that_has_ended_by_a_new_epoch_lets_a_disc_be_struck_again() -> None:
    """An edge strikes a disc, turns to go after it, and strikes it again; other impacts begin an epoch between."""
    edge = Chain(points_m=[(-1, -1), (-1, 1)], legs=legs((0, 0.5), (2, 3)))
    busy = [Chain(points_m=[(9, y), (11, y)]) for y in (0.0, 1.0)]
    slow = disc_at(0, 0, -0.5, r=0.25)
    quick = disc_at(10, 0.5, 0, 13.125, r=0.25)
    plain = assert_same(staged("again", slow, quick, edge, *busy, duration_s=3.5))
    struck = plain.log.array()
    times_s = struck["time_s"][struck["first"] == 0]
    assert times_s == pytest.approx([0.75, 2.0 + 5.0 / 6.0])
    assert np.count_nonzero(struck["time_s"] < 2.0) < 64 < np.count_nonzero(struck["time_s"] < times_s[1])


def test_legs_are_counted_from_each_epoch() -> None:
    """Two discs in a box of which one wall turns back every tenth of a second, over several epochs."""
    turns = legs(*((0.1 * k, 0.4 * (-1) ** k) for k in range(60)))
    walls = [
        wall_at(0, 0, 1, 0.01, legs=turns),
        *(Wall(point_m=(1, 1), normal=normal) for normal in ((-1, 0), (0, -1))),
        wall_at(0, 0, 0, 1),
    ]
    discs = [disc_at(x, x, 14.0 * x, 22.0 - 18.0 * x, r=0.1) for x in (0.3, 0.7)]
    plain = assert_same(staged("shaken", *discs, *walls, duration_s=6.0), 300)
    assert plain.counts["epochs"] >= 4
    assert plain.time_s > 3.0
