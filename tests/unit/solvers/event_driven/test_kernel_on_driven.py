"""The kernel where something is driven: ties, legs and crushes; random tables: see test_equivalences."""

import math
from typing import Any

import numpy as np
import pytest
from tests.cases import each
from tests.scene_builders import disc_at, drive_on_legs, staged, wall_at
from tests.unit.solvers.run_kinds import assert_same

from carom import Chain, Disc, Outcome, Scene
from carom.solvers.event_driven import run as event_driven
from carom.solvers.event_driven.run import EventDrivenRun

pytest.importorskip("carom.core.pic")


def build_legs(*parts: tuple[float, float]) -> dict[str, Any]:
    """Return the drive of a body along x: when each leg begins, and its speed."""
    return drive_on_legs(*((begin, (speed, 0.0)) for begin, speed in parts))


def build_mallet(x: float, y: float, speed: float = 0.0, **legs: Any) -> Disc:
    """Return a disc of radius 1/4 that is driven along x."""
    return disc_at(x, y, speed, r=0.25, m=math.inf, driven=True, **legs)


PUCK = disc_at(0.0, 0.0, 1.0, r=0.25)
#: What meets a puck at one instant, to the bit; and how often it is struck in two seconds.
AT_ONCE: dict[str, tuple[list[Disc], list[Any], int]] = {
    "both edges of a corner": ([PUCK], [Chain(points_m=[(2, -2), (4, 0), (2, 2)], velocity_m_s=(-1.0, 0.0))], 2),
    "an edge as it turns back": (
        [PUCK],
        [Chain(points_m=[(2.25, -1), (2.25, 1)], **build_legs((0, -1), (1, 1)))],
        0,
    ),
    "an edge as it turns to come": (
        [PUCK],
        [Chain(points_m=[(1.25, -1), (1.25, 1)], **build_legs((0, 0), (1, -1)))],
        1,
    ),
    "a wall, and one that sets out then": (
        [PUCK.model_copy(update={"velocity_m_s": (1.0, 1.0)})],
        [
            Chain(points_m=[(-3, 1.25), (3, 1.25)]),
            Chain(points_m=[(1.25, -3), (1.25, 3)], **build_legs((0, 0), (1, -1))),
        ],
        2,
    ),
    "a mallet that is disc 0": ([build_mallet(1.5, 0.0, -0.5), PUCK], [], 1),
    "two mallets": ([PUCK, build_mallet(1.0, 0.375, -1.0), build_mallet(1.0, -0.375, -1.0)], [], 2),
    "a disc and a mallet": ([PUCK, disc_at(1.0, 0.375, -1.0, r=0.25), build_mallet(1.0, -0.375, -1.0)], [], 2),
    "a mallet as it turns back": ([PUCK, build_mallet(2.5, 0, **build_legs((0, -1), (1, 1)))], [], 0),
    "a mallet that turns to come": (
        [PUCK, build_mallet(1.5, 0, **build_legs((0, 0), (1, -1)))],
        [],
        1,
    ),
}


@each("name", AT_ONCE)
def test_simultaneous_events_match_all_pairs_to_the_bit(name: str) -> None:
    """Simultaneous impacts with edges, walls, discs and mallets have the order and bits of all pairs."""
    discs, walls, impacts = AT_ONCE[name]
    plain = assert_same(staged("at once", *discs, *walls, duration_s=2.0))
    assert plain.impacts == impacts


def build_row(discs: int, gap: float, speed: float) -> Scene:
    """Return discs in a row between a wall and one that comes, at the head of a mallet."""
    places = [gap + (1.0 + gap) * k for k in range(discs)]
    free = [disc_at(0.5 + x, 0.0, 0.25 * (-1) ** k) for k, x in enumerate(places)]
    return staged(
        "row", *free, build_mallet(places[-1] + 1.75 + gap, 0.0, -speed), wall_at(0, 0, 1, 0), duration_s=20.0
    )


def build_pinched_disc(half: float) -> Scene:
    """Return a disc that goes sideways between an edge and one that comes, each of this half length."""
    edge = Chain(points_m=[(-half, 0), (half, 0)])
    piston = Chain(points_m=[(-half, 2), (half, 2)], velocity_m_s=(0.0, -0.25))
    disc = disc_at(0.0, 1.0, 0.125, 0.5, r=0.25)
    return staged("pinched", disc, edge, piston, duration_s=20.0)


@each(
    "scene, between, time_s",
    [
        # The mallet's rim is 1 m further than the disc is wide, at 1/8 m/s; the piston 3/2 m, at 1/4 m/s.
        (build_row(1, 0.25, 0.125), "wall 0 and disc 1", 8.0),
        (build_pinched_disc(3.0), "wall 0 and wall 1", 6.0),
        (build_pinched_disc(0.5), "", 20.0),
    ],
)
def test_disc_is_crushed_when_no_space_is_left_or_escapes(scene: Scene, between: str, time_s: float) -> None:
    """A disc between closing bodies ends the run with a note of the bodies and the time, unless the edges are short."""
    run = assert_same(scene, 10**6)
    assert run.advance_to(20.0) is (Outcome.CRUSHED if between else Outcome.COMPLETED)
    if between:
        begin, _, at = run.notes[0].removesuffix(" s").rpartition(" at ")
        assert begin == f"disc 0 is crushed between {between}"
        assert float(at) == pytest.approx(time_s, rel=1e-14)
        assert run.time_s < time_s


def test_crush_after_the_requested_end_does_not_end_the_run() -> None:
    """A run to 7.99 s completes, and one to 8.01 s ends with CRUSHED, for a crush at 8 s."""
    # The rule decides after 400 impacts, at 7.96 s.
    start = build_row(1, 0.25, 0.125).arrays
    assert EventDrivenRun(start).advance_to(7.99) is Outcome.COMPLETED
    assert EventDrivenRun(start).advance_to(8.01) is Outcome.CRUSHED


def test_disc_that_hits_another_before_a_crush_is_not_crushed(monkeypatch: pytest.MonkeyPatch) -> None:
    """A disc that would be crushed at 2 s hits another disc first, at about 1.9 s, after seven bounces."""
    walls = wall_at(0.0, 0.0, 1.0, 0.0), wall_at(2.5, 0.0, -1.0, 0.0, velocity_m_s=(-1.0, 0.0))
    discs = disc_at(1.0, -1.9, 0.0, 1.0, r=0.25), disc_at(0.25, 0.5, r=0.25, m=math.inf)
    monkeypatch.setattr(event_driven, "compute_standstill_limit", lambda _: 3)  # after this number the rule decides
    run = EventDrivenRun(staged("crush", *discs, *walls, duration_s=3.0))
    run.advance_to(3.0, 8)
    assert run.log.array()["second"].tolist() == [-2, -1, -2, -1, -2, -1, -2, 1]


def test_edge_on_a_new_leg_strikes_a_disc_again_after_an_epoch() -> None:
    """An edge strikes a disc at 0.75 s, follows it on its next leg, and strikes it again in a new epoch."""
    edge = Chain(points_m=[(-1, -1), (-1, 1)], **build_legs((0, 0.5), (2, 3)))
    busy = [Chain(points_m=[(9, y), (11, y)]) for y in (0.0, 1.0)]
    slow = disc_at(0, 0, -0.5, r=0.25)
    quick = disc_at(10, 0.5, 0, 13.125, r=0.25)
    plain = assert_same(staged("again", slow, quick, edge, *busy, duration_s=3.5))
    struck = plain.log.array()
    times_s = struck["time_s"][struck["first"] == 0]
    assert times_s == pytest.approx([0.75, 2.0 + 5.0 / 6.0])
    assert np.count_nonzero(struck["time_s"] < 2.0) < 64 < np.count_nonzero(struck["time_s"] < times_s[1])
