"""Two discs and no wall: the closed form is the event-driven run to the bit."""

import math

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from tests.scene_builders import disc_at, staged

from carom.model.scene import Disc, Scene
from carom.model.trace import Outcome, Trace
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
        position = (draw(numbers), draw(numbers))
        found.append(Disc(position_m=position, velocity_m_s=velocity, radius_m=radius, mass_kg=mass))
    return found[0], found[1]


ends = st.one_of(st.just(0.0), st.floats(0, 1e3))
restitutions = st.sampled_from([0.0, 0.5, 1.0])


def are_identical(one: Trace, other: Trace) -> bool:
    return (
        one.impacts.tobytes() == other.impacts.tobytes()
        and np.array_equal(one.final_position_m, other.final_position_m)
        and np.array_equal(one.final_velocity_m_s, other.final_velocity_m_s)
        and (one.end_time_s, one.outcome, one.ambiguous) == (other.end_time_s, other.outcome, other.ambiguous)
        and one.impacts_per_disc is not None
        and other.impacts_per_disc is not None
        and np.array_equal(one.impacts_per_disc, other.impacts_per_disc)
    )


@given(draw_pairs(), restitutions, ends, st.sampled_from([None, 0, 1, 5]))
def test_closed_form_equals_the_event_driven_run(
    two: tuple[Disc, Disc], restitution: float, end: float, limit: int | None
) -> None:
    r"""For two discs without walls, the closed form gives the trace of the event-driven run to the bit.

    A progress callback selects the event-driven run.
    """
    if math.dist(two[0].position_m, two[1].position_m) < two[0].radius_m + two[1].radius_m:
        return
    scene = Scene(name="two", discs=two, restitution=restitution, duration_s=2e3)
    closed = solve_pic(scene, until_s=end, max_impacts=limit)
    run = solve_pic(scene, until_s=end, max_impacts=limit, progress=lambda *_: None)
    assert are_identical(closed, run)


def test_head_on_discs_meet_at_2_s_and_exchange_velocities() -> None:
    """Discs of radius 0.5 m with centres 3 m apart meet after 2 s at 1 m/s and exchange velocities."""
    scene = staged("head-on", disc_at(0, 0, 1, 0), disc_at(3, 0), duration_s=5.0)
    trace = solve_pic(scene)
    assert trace.impacts["time_s"].tolist() == [2.0]
    assert trace.impacts[["first", "second"]].tolist() == [(0, 1)]
    assert trace.impacts["normal"].tolist() == [[1.0, 0.0]]
    assert trace.impacts["velocity_first_before"].tolist() == [[1.0, 0.0]]
    assert trace.impacts["velocity_second_after"].tolist() == [[1.0, 0.0]]
    assert trace.final_position_m.tolist() == [[2.0, 0.0], [6.0, 0.0]]
    assert trace.final_velocity_m_s.tolist() == [[0.0, 0.0], [1.0, 0.0]]
    assert trace.outcome is Outcome.COMPLETED
    assert not trace.impacts.flags.writeable
    before = solve_pic(scene, until_s=1.5)
    assert len(before.impacts) == 0
    assert before.final_position_m.tolist() == [[1.5, 0.0], [3.0, 0.0]]
