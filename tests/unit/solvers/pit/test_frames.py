"""PIT: exactly Algorithm 1, with its late impacts, wrong normals and misses."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.scene_builders import build_line_scene, disc_at, staged, wall_at
from tests.unit.solvers.pit.run_forms import list_compiled_forms, run_to_end

from carom.errors import InputError
from carom.solvers.pic import solve_pic
from carom.solvers.pit.clock import FrameClock
from carom.solvers.pit.solve import solve_pit

U = 2.0**-53


def test_pit_impact_matches_the_hand_calculation() -> None:
    """PIT finds the contact of 0.325 s at the frame of 0.5 s, with a wrong normal and wrong velocities."""
    # At .5 s the centres are (.45, .6) apart, so the approach speed is 2 * .6 = 1.2 and equal masses exchange it along
    # (.6, .8). None of these numbers is above 2, and each takes fewer than 20 roundings to compute.
    scene = staged("3-4-5", disc_at(0, 0, 2, 0), disc_at(1.45, 0.6), duration_s=1, frame_rate_hz=2)
    trace = solve_pit(scene)
    (impact,) = trace.impacts
    tolerance = 20 * 2 * U
    assert impact["time_s"] == 0.5
    np.testing.assert_allclose(impact["normal"], [0.6, 0.8], rtol=0, atol=tolerance)
    np.testing.assert_allclose(impact["velocity_first_after"], [1.28, -0.96], rtol=0, atol=tolerance)
    np.testing.assert_allclose(impact["velocity_second_after"], [0.72, 0.96], rtol=0, atol=tolerance)
    np.testing.assert_allclose(trace.final_position_m, [[1.64, -0.48], [1.81, 1.08]], rtol=0, atol=tolerance)
    assert abs(solve_pic(scene).impacts[0]["time_s"] - 0.325) <= 128 * U  # as derived in the tests of PIC


def test_pit_does_not_correct_positions() -> None:
    """PIT leaves discs overlapping at the frame of the impact; they separate from those positions."""
    trace = solve_pit(build_line_scene(0.0, 2.75, velocities=(1.0, 0.0), duration_s=2.5), frame_rate_hz=1.0)
    # Contact is at 1.75 s; at the frame of 2 s the discs overlap by 1/4; then disc 1 moves on alone for half a second.
    assert trace.impacts["time_s"].tolist() == [2.0]
    np.testing.assert_array_equal(trace.final_position_m[:, 0], [2.0, 3.25])


@given(
    st.integers(1, 16),
    st.integers(-16, 16),
    st.integers(17, 200),
    st.integers(1, 64),
    st.sampled_from([0.5, 1, 2, 4, 8]),
)
def test_pit_finds_the_first_frame_between_entry_and_closest_approach(
    contact: int, aside: int, ahead: int, speed: int, rate: float
) -> None:
    """Two discs collide at the first frame in [t_enter, t_closest), and not at all if no frame is there."""
    # All numbers are multiples of 1/64 of at most 20 bits, so that frames, positions and the overlap test are exact.
    closest = ahead / speed
    duration = math.ceil(closest) + 1.0
    scene = staged(
        "two",
        disc_at(-ahead / 8, aside / 8, speed / 8, 0, r=contact / 16),
        disc_at(0, 0, r=contact / 16),
        duration_s=duration,
        frame_rate_hz=rate,
    )
    expected = []
    for frame in range(int(duration * rate)):
        x = speed * frame / rate - ahead  # in eighths, exact
        if x < 0 and x * x + aside * aside <= contact * contact:
            expected.append(frame / rate)
            break
    assert solve_pit(scene).impacts["time_s"].tolist() == expected


def test_impacts_of_one_frame_are_ordered_by_disc_index() -> None:
    """In one frame pairs are tested by disc index, each with the velocities after the earlier impacts."""
    trace = solve_pit(build_line_scene(0.0, 1.75, 3.0, velocities=(4.0, 0.0, -4.0), duration_s=1.0), frame_rate_hz=4.0)
    # At .25 s: 1.0, 1.75, 2.0, so that (0, 1), (0, 2) and (1, 2) overlap; 0 and 1 exchange, then 1 meets 2.
    now = trace.impacts[trace.impacts["time_s"] == 0.25]
    assert [(int(i["first"]), int(i["second"])) for i in now] == [(0, 1), (0, 2), (1, 2)]
    np.testing.assert_array_equal(now[0]["velocity_first_after"], [0, 0])
    np.testing.assert_array_equal(now[1]["velocity_first_before"], [0, 0])
    np.testing.assert_array_equal(now[1]["velocity_first_after"], [-4, 0])
    np.testing.assert_array_equal(now[2]["velocity_first_before"], [4, 0])
    np.testing.assert_array_equal(now[2]["velocity_second_before"], [0, 0])
    assert trace.ambiguous == (1, 2)


def test_disc_pairs_are_tested_before_walls_in_a_frame() -> None:
    """Discs that overlap each other and a wall at one frame collide with each other first, then with the wall."""
    scene = staged(
        "wall", disc_at(1, 0, -2, 0), disc_at(2.5, 0, -4, 0), wall_at(0, 0, 1, 0), duration_s=1, frame_rate_hz=2
    )
    trace = solve_pit(scene)
    assert [(int(i["first"]), int(i["second"])) for i in trace.impacts] == [(0, 1), (0, -1), (1, -1)]
    np.testing.assert_array_equal(trace.impacts[1]["velocity_first_after"], [4, 0])


def test_overlapping_discs_that_separate_do_not_collide_again() -> None:
    """Discs that still overlap at the frames after a late impact, but separate, do not collide again."""
    trace = solve_pit(build_line_scene(0.0, 1.5, velocities=(1.0, 0.0), duration_s=2.0), frame_rate_hz=4.0)
    assert trace.impacts["time_s"].tolist() == [0.5]
    late = solve_pit(
        build_line_scene(0.0, 1.9375, velocities=(1.0, 0.0), duration_s=4.0, restitution=0.25), frame_rate_hz=1.0
    )
    assert len(late.impacts) == 1


def test_last_frame_before_the_end_is_tested_but_not_the_end() -> None:
    """Frames are tested from 0 s to the last one before the duration; the final state is that at the duration."""
    scene = build_line_scene(0.0, 3.0, velocities=(1.0, 0.0), duration_s=2.0)
    assert len(solve_pit(scene, frame_rate_hz=4.0).impacts) == 0
    longer = build_line_scene(0.0, 3.0, velocities=(1.0, 0.0), duration_s=2.125)
    trace = solve_pit(longer, frame_rate_hz=4.0, skipping=False)
    assert trace.impacts["time_s"].tolist() == [2.0]
    assert (trace.method, trace.end_time_s, trace.dt_s) == ("pit", 2.125, 0.25)
    assert trace.counts == {"frames": 9, "frames_looked_at": 9, "frames_skipped": 0, "pair_tests": 9}
    np.testing.assert_array_equal(trace.final_position_m[:, 0], [2.0, 3.125])


def test_impact_without_a_representable_normal_raises_an_error() -> None:
    """Discs that meet at 1e18 m, where floats cannot represent their distance, raise an InputError in all forms."""
    discs = disc_at(0.0, 0.0, 4e-9), disc_at(3.0, 0.0)
    scene = staged("far", *discs, gravity_m_s2=(0.0, -9.8), duration_s=1e9)
    for form in list_compiled_forms().values():
        with pytest.raises(InputError, match="cannot represent the distance"):
            run_to_end(scene, FrameClock(rate_hz=1e-7), form)
