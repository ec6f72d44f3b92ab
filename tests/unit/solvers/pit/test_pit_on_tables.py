"""Compiled PIT on finite walls: every bit of the definition, whether it skips or not."""

from __future__ import annotations

import random
from functools import cache

import numpy as np
import pytest
from tests.lengths import each
from tests.unit.solvers.pit.forms import assert_identical, compiled_forms, definition, finished

from carom import Chain, Disc, Scene
from carom.solvers.pit.clock import FrameClock

pytest.importorskip("carom.solvers.pit.frame_loop")


@cache
def met_s(*bulges: float) -> float:
    """When a disc meets a floor of one edge, in all forms."""
    discs = [Disc(position_m=(0.3, 2.0), velocity_m_s=(0.1, -1.003), radius_m=0.25)]
    floor = Chain(points_m=[(-1, 0), (1, 0)], bulges=bulges)
    scene = Scene(name="floor", discs=discs, walls=[floor], duration_s=2.0)
    (time_s,) = assert_identical(scene, FrameClock(rate_hz=1000.0)).log.array()["time_s"].tolist()
    return float(time_s)


@each("bulge", [1e-3, -1e-6, 1e-15, 1e-9, -1e-12])
def test_a_nearly_flat_arc_is_met_as_a_segment_is(bulge: float) -> None:
    """In all forms, at the frame at which a disc overlaps the segment from end to end."""
    # The arc's middle is off the segment by the bulge, in metres, at a metre a second; and a frame more or less.
    assert abs(met_s(bulge) - met_s()) <= abs(bulge) + 1.5e-3 * (abs(bulge) > 1e-4)


def test_many_discs_in_cells_have_the_bits_of_the_definition() -> None:
    """More of them than are looked through one by one, in a stadium with a bar."""
    draw = random.Random(5)
    places = [(x - 2.5, y - 1.5) for x in range(-2, 8) for y in range(4)]
    discs = [
        Disc(position_m=place, velocity_m_s=(draw.gauss(0, 2), draw.gauss(0, 2)), radius_m=draw.uniform(0.1, 0.3))
        for place in places
    ]
    stadium = Chain(points_m=[(-4, -3), (5, -3), (5, 3), (-4, 3)], bulges=[0, 1, 0, 1], closed=True)
    bar = Chain(points_m=[(-1, 2.5), (3, 2.25)], half_width_m=0.125)
    scene = Scene(name="stadium of many", discs=discs, walls=[stadium, bar], duration_s=2.0)
    run = assert_identical(scene, FrameClock(rate_hz=120.0))
    assert np.count_nonzero(run.log.array()["second"] < 0) > 20


def test_a_disc_far_from_a_wall_is_looked_at_a_handful_of_times() -> None:
    """Until it can have come there, no test is made; and none at all of one that stands."""
    line = Chain(points_m=[(10, -1), (10, 1)])
    for velocity, most in (((1.0, 0.0), 20), ((0.0, 0.0), 1)):
        disc = Disc(position_m=(0, 0), velocity_m_s=velocity, radius_m=0.5)
        scene = Scene(name="far", discs=[disc], walls=[line], duration_s=9.0)
        clock = FrameClock(rate_hz=1000.0)
        counts = finished(scene, clock, compiled_forms()["always skipping"]).counts
        assert counts["frames"] == 9000
        assert counts["frames_looked_at"] <= most
    assert finished(scene, clock, definition).counts["frames_looked_at"] == 9000
