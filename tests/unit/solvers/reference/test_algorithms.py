"""The algorithms of the paper, as definitions of PIT and PIC."""

import math

import numpy as np
import pytest
from tests.cases import each, release_after
from tests.random_scenes import KINDS, draw_scene
from tests.scene_builders import build_line_scene

from carom import Chain, solve_pit
from carom.errors import InputError
from carom.model.trace import build_impact_array
from carom.solvers.reference.algorithm_1 import run_algorithm_1
from carom.solvers.reference.algorithm_2 import solve_pic_framewise

#: Tests of pairs at all frames that a scene may need.
MOST_TESTS = 1e6


@each("kind", KINDS)
@each("numbers", release_after(1, [range(2), range(2, 40)]))
def test_solve_pit_matches_algorithm_1_to_the_bit(kind: str, numbers: range) -> None:
    """`solve_pit` gives the impacts and final states of Algorithm 1 on random scenes, to the bit."""
    for number in numbers:
        scene = draw_scene(kind, number)
        if scene.duration_s * scene.frame_rate_hz * len(scene.discs) ** 2 > MOST_TESTS:
            continue
        trace, (impacts, discs) = solve_pit(scene), run_algorithm_1(scene)
        assert trace.impacts.tobytes() == build_impact_array(impacts).tobytes(), scene.name
        np.testing.assert_array_equal(trace.final_position_m, [(disc.x, disc.y) for disc in discs])
        np.testing.assert_array_equal(trace.final_velocity_m_s, [disc.velocity for disc in discs])


@each(
    "fields",
    [
        {"gravity_m_s2": (0.0, -1.0)},
        {"damping_per_s": 0.5},
        {"friction": 0.5},
        {"walls": [Chain(points_m=[(-5, -5), (5, -5)])]},
    ],
)
def test_algorithm_1_refuses_unsupported_scenes(fields: dict[str, object]) -> None:
    """Algorithm 1 raises an InputError for gravity, damping, friction and finite walls."""
    scene = build_line_scene(0.0, 3.0, velocities=(1.0, 0.0))
    with pytest.raises(InputError, match="Algorithm 1 is for discs and half-planes"):
        run_algorithm_1(type(scene)(**{**dict(scene), **fields}))


# Algorithm 2: PIC from frame to frame ---------------------------------------------------------------------------------


def test_algorithm_2_resolves_all_impacts_of_one_frame() -> None:
    """Three impacts in a single frame all happen, at 1, 2 and 3 s."""
    scene = build_line_scene(0.0, 2.0, 4.0, 6.0, velocities=(1.0, 0.0, 0.0, 0.0))
    trace = solve_pic_framewise(scene, frame_rate_hz=0.1)
    assert trace.counts["frames"] == 1
    assert trace.impacts["time_s"].tolist() == [1.0, 2.0, 3.0]


@each("rate", [1.0, 0.5, 0.25])
def test_algorithm_2_reports_an_impact_at_a_frame_once(rate: float) -> None:
    """An impact exactly at a frame, also at the last one, is reported exactly once."""
    scene = build_line_scene(0.0, 5.0, velocities=(1.0, 0.0), duration_s=4.0)
    trace = solve_pic_framewise(scene, frame_rate_hz=rate)
    assert trace.impacts["time_s"].tolist() == [4.0]


def test_algorithm_2_frame_rate_defaults_to_the_scene() -> None:
    """Algorithm 2 uses the scene's frame rate unless one is given; the trace has the frame length."""
    scene = build_line_scene(0.0, velocities=(1.0,), duration_s=2.0)
    assert solve_pic_framewise(scene).dt_s == 1 / 60
    assert solve_pic_framewise(scene).counts["frames"] == 120
    assert solve_pic_framewise(scene, frame_rate_hz=8.0).dt_s == 0.125


@each("rate", [0.0, -60.0, math.nan, math.inf])
def test_frame_rate_that_is_not_positive_is_refused(rate: float) -> None:
    """A frame rate that is 0, negative, infinite or NaN raises an InputError with its name and value."""
    for solve in (solve_pit, solve_pic_framewise):
        with pytest.raises(InputError, match=f"frame_rate_hz must be a positive number, got {rate}"):
            solve(build_line_scene(0.0, velocities=(1.0,)), frame_rate_hz=rate)


def test_frame_rate_that_is_too_low_is_refused() -> None:
    """A frame rate whose frame length exceeds the largest float raises an InputError with the allowed range."""
    with pytest.raises(InputError, match=r"frame_rate_hz must be between 1\.49e-154 and 6\.7e153"):
        solve_pic_framewise(build_line_scene(0.0, velocities=(1.0,)), frame_rate_hz=1e-310)
