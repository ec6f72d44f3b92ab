"""Two discs and no wall: the closed form is the event-driven run to the bit."""

import math
from typing import Any

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from tests.scene_builders import disc_at, require_value, staged

from carom.model.scene import Disc
from carom.model.trace import Trace
from carom.solvers.pic import solve_pic

small = st.integers(-8, 8).map(lambda k: k / 4)
anything = st.floats(-100, 100)
numbers = st.one_of(small, anything)
masses = st.sampled_from([0.5, 1.0, 3.0, math.inf])


@st.composite
def draw_pairs(draw: st.DrawFn) -> tuple[Disc, Disc]:
    """Draw two discs, of round numbers often, so that they graze, touch, or move alike."""
    found = []
    for _ in range(2):
        mass = draw(masses)
        velocity = (0.0, 0.0) if math.isinf(mass) else (draw(numbers), draw(numbers))
        radius = draw(st.one_of(st.sampled_from([0.25, 0.5, 1.0]), st.floats(1e-3, 10)))
        found.append(disc_at(draw(numbers), draw(numbers), *velocity, r=radius, m=mass))
    return found[0], found[1]


ends = st.one_of(st.just(0.0), st.floats(0, 1e3))
restitutions = st.sampled_from([0.0, 0.5, 1.0])


def list_results(trace: Trace) -> list[Any]:
    arrays = [trace.final_position_m, trace.final_velocity_m_s, require_value(trace.impacts_per_disc)]
    return [*arrays, trace.impacts.tobytes(), trace.end_time_s, trace.outcome, trace.ambiguous]


@given(draw_pairs(), restitutions, ends, st.sampled_from([None, 0, 1, 5]))
def test_closed_form_equals_the_event_driven_run(
    two: tuple[Disc, Disc], restitution: float, end: float, limit: int | None
) -> None:
    """For two discs without walls, the closed form gives the trace of the event-driven run to the bit."""
    # A progress callback selects the event-driven run.
    if math.dist(two[0].position_m, two[1].position_m) < two[0].radius_m + two[1].radius_m:
        return
    scene = staged("two", *two, restitution=restitution, duration_s=2e3)
    closed = solve_pic(scene, until_s=end, max_impacts=limit)
    run = solve_pic(scene, until_s=end, max_impacts=limit, progress=lambda *_: None)
    for one, other in zip(*(list_results(trace) for trace in (closed, run)), strict=True):
        assert np.array_equal(one, other)
