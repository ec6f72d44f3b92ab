"""The kernel on finite walls: cells, what ends a run, and what is refused; random tables: see test_equivalences."""

import math
import random
from collections.abc import Callable
from dataclasses import replace
from itertools import product

import numpy as np
import pytest
from tests.cases import each, release_after
from tests.scene_builders import disc_at, require_value, staged
from tests.unit.solvers.run_kinds import all_pairs, assert_same

from carom import Chain, Outcome, Scene
from carom.errors import InputError
from carom.model.chain_geometry import Outline
from carom.model.disc_arrays import DiscArrays
from carom.solvers.event_driven import run as event_driven
from carom.solvers.event_driven.run import EventDrivenRun

pytest.importorskip("carom.core.pic")


def build_gas_among_segments(segments: int) -> Scene:
    """Return a gas in a box with short segments between the discs, so that each cell knows few of them."""
    rnd, discs, walls = random.Random(8), [], []
    for y, x in product(range(0, 10, 2), repeat=2):
        discs.append(disc_at(x, y, rnd.gauss(0, 1), rnd.gauss(0, 1), r=0.4))
        walls.append(Chain(points_m=[(x + 0.9, y + 0.9), (x + 1.1, y + 1.0 + rnd.uniform(-0.2, 0.2))]))
    box = Chain(points_m=[(-1, -1), (10, -1), (10, 10), (-1, 10)], closed=True)
    return staged("gas among segments", *discs, box, *walls[:segments], duration_s=100.0)


@each("segments, most, cells", release_after(1, [(25, 50, 1.0), (25, 200, 1.0), (12, 100, 2.5)]))
def test_gas_among_segments_matches_all_pairs_to_the_bit(segments: int, most: int, cells: float) -> None:
    """A gas among short segments, few of which each cell lists, has the bits of all pairs."""
    assert_same(build_gas_among_segments(segments), most, cells=cells)


def build_gas_in_polygon(edges: int, radius: float) -> Scene:
    """Return sixteen discs in the middle of a regular polygon, far from its edges."""
    rnd = random.Random(9)
    discs = [disc_at(x, y, rnd.gauss(0, 1), rnd.gauss(0, 1), r=0.4) for x, y in product(range(-2, 2), repeat=2)]
    turns = [2 * math.pi * k / edges for k in range(edges)]
    wall = Chain(points_m=[(radius * math.cos(turn), radius * math.sin(turn)) for turn in turns], closed=True)
    return staged("gas in a polygon", *discs, wall, duration_s=1e3)


@each("options", release_after(1, [{"cells": 3.0}, {"contact_s": 0.01}, {"cells": math.inf}, {}]))
def test_newly_chosen_cells_match_all_pairs_to_the_bit(options: dict[str, float]) -> None:
    """A gas that leaves its first box gets new cells and keeps the bits of all pairs."""
    scene = build_gas_in_polygon(12, 8.0)
    assert_same(scene, 200, **options)
    run = EventDrivenRun(scene)
    run.advance_to(math.inf, 200)
    assert run.counts["choices"] > 0


@each("form", [EventDrivenRun, all_pairs])
def test_run_that_ended_in_gliding_stays_ended(form: Callable[[Scene], EventDrivenRun]) -> None:
    """A run that ended with GLIDES returns the same outcome, time and state for any later request."""
    stadium = Chain(points_m=[(-2, -2), (2, -2), (2, 2), (-2, 2)], bulges=[0, 1, 0, 1], closed=True)
    run = form(staged("stadium", disc_at(0, -1.5, 1), stadium, duration_s=10.0))
    assert run.advance_to(1.0) is Outcome.COMPLETED
    for until_s in (10.0, 1.0, math.inf):
        assert run.advance_to(until_s) is Outcome.GLIDES
        assert (run.time_s, run.positions().tolist()) == (2.0, [[2.0, -1.5]])
    assert run.notes == ("disc 0 glides along wall 0 from 2 s on",)


def test_too_many_wall_features_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    """More sides and vertices than can be numbered raise an InputError with their number."""
    scene = staged("triangle", disc_at(0, 4, 1), Chain(points_m=[(3, 3), (5, 3), (4, 5)], closed=True), duration_s=10.0)
    monkeypatch.setattr(event_driven, "MOST_OBSTACLES", 8)  # of nine: three edges with two sides and a vertex each
    for start in (scene, replace(scene.arrays, walls=((0.0, 0.0, 0.0, 1.0),) * 9)):
        with pytest.raises(InputError, match="walls must have at most 8 sides and vertices in all, got 9"):
            EventDrivenRun(start)


def test_finite_walls_can_be_given_as_arrays() -> None:
    """DiscArrays accept outlines and half-planes as walls; a disc that overlaps one raises an InputError."""
    line = Outline(((2.0, -1.0), (2.0, 1.0)), (0.0,), 0.25)
    fields = (np.array([[1.0, 0.0]]), np.array([0.5]), np.ones(1))
    start = DiscArrays(np.zeros((1, 2)), *fields, walls=(line, (-2.0, 0.0, 1.0, 0.0)))
    run = EventDrivenRun(start)
    run.advance_to(10.0)
    # From 0 to 1.25, back to -1.5, and to 1.25 again.
    assert run.log.array()["time_s"].tolist() == [1.25, 4.0, 6.75, 9.5]
    assert require_value(run.log.edges())["edge"].tolist() == [0, -1, 0, -1]
    with pytest.raises(InputError, match="must not overlap wall 0"):
        EventDrivenRun(DiscArrays(np.array([[1.5, 0.0]]), *fields, walls=(line,)))
