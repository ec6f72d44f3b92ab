"""Scenes of the benchmark of the kinds of motion."""

from __future__ import annotations

from benchmarks.kinds import PIC_TARGETS
from benchmarks.kinds_worker import KINDS, time_pic, time_pit
from tests.lengths import each

_DISCS, _IMPACTS, _LIMIT_S = 5, 6, 60.0


@each("kind", KINDS)
def test_each_kind_builds_and_has_impacts(kind: str) -> None:
    """PIC finds the number of impacts that is asked for, in every kind of motion."""
    _, events = time_pic(kind, _DISCS, _IMPACTS, "all", 1, _LIMIT_S)
    assert events >= _IMPACTS


@each("kind", KINDS)
def test_each_kind_runs_by_frames(kind: str) -> None:
    """PIT runs every kind of motion over the frames that are asked for."""
    _, frames = time_pit(kind, _DISCS, 2, "all", 1, _LIMIT_S)
    assert frames == 2


def test_each_kind_has_a_target() -> None:
    """Every kind but the plain gas is compared with a target."""
    assert set(PIC_TARGETS) == set(KINDS) - {"plain"}
