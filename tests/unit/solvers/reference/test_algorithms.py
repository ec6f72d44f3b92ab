"""The algorithms of the paper, as definitions of PIT and PIC."""

import math

import numpy as np
import pytest
from tests.cases import each, release_after
from tests.random_scenes import KINDS, drawn
from tests.scene_builders import line

from carom import Chain, solve_pit
from carom.errors import InputError
from carom.model.trace import build_impact_array
from carom.solvers.reference.algorithm_1 import run_algorithm_1
from carom.solvers.reference.algorithm_2 import solve_pic_framewise

#: Tests of pairs at all frames that a scene may need.
MOST_TESTS = 1e6


@each("kind", KINDS)
@each("numbers", release_after(1, [range(3), range(3, 40)]))
def test_solve_pit_gives_the_bits_of_the_definition(kind: str, numbers: range) -> None:
    """Skipping of frames, cells and sweeps change no bit."""
    for number in numbers:
        scene = drawn(kind, number)
        if scene.duration_s * scene.frame_rate_hz * len(scene.discs) ** 2 > MOST_TESTS:
            continue
        trace, found = solve_pit(scene), run_algorithm_1(scene)
        assert trace.impacts.tobytes() == build_impact_array(found.impacts).tobytes(), scene.name
        np.testing.assert_array_equal(trace.final_position_m, [(disc.x, disc.y) for disc in found.discs])
        np.testing.assert_array_equal(trace.final_velocity_m_s, [disc.velocity for disc in found.discs])


@each(
    "fields",
    [
        {"gravity_m_s2": (0.0, -1.0)},
        {"damping_per_s": 0.5},
        {"friction": 0.5},
        {"walls": [Chain(points_m=[(-5, -5), (5, -5)])]},
    ],
)
def test_what_it_has_no_part_for_is_refused(fields: dict[str, object]) -> None:
    """Algorithm 1 of the paper has no gravity, damping, friction or finite walls."""
    scene = line(0.0, 3.0, velocities=(1.0, 0.0))
    with pytest.raises(InputError, match="Algorithm 1 is for discs and half-planes"):
        run_algorithm_1(type(scene)(**{**dict(scene), **fields}))


# Algorithm 2: PIC from frame to frame ---------------------------------------------------------------------------------


def test_all_impacts_of_one_frame_are_carried_out() -> None:
    """Three impacts in a single frame all happen, each at its own instant."""
    scene = line(0.0, 2.0, 4.0, 6.0, velocities=(1.0, 0.0, 0.0, 0.0))
    trace = solve_pic_framewise(scene, frame_rate_hz=0.1)
    assert trace.counts["frames"] == 1
    assert trace.impacts["time_s"].tolist() == [1.0, 2.0, 3.0]


@each("rate", [1.0, 0.5, 0.25])
def test_an_impact_on_a_frame_instant_happens_once(rate: float) -> None:
    """An impact exactly at a frame instant, be it the last one, is neither lost nor doubled."""
    scene = line(0.0, 5.0, velocities=(1.0, 0.0), duration_s=4.0)
    trace = solve_pic_framewise(scene, frame_rate_hz=rate)
    assert trace.impacts["time_s"].tolist() == [4.0]


def test_the_frame_rate_is_the_scenes_own_unless_given() -> None:
    """Without a rate the scene's is taken, and the trace tells the frame length."""
    scene = line(0.0, velocities=(1.0,), duration_s=2.0)
    assert solve_pic_framewise(scene).dt_s == 1 / 60
    assert solve_pic_framewise(scene).counts["frames"] == 120
    assert solve_pic_framewise(scene, frame_rate_hz=8.0).dt_s == 0.125


@each("rate", [0.0, -60.0, math.nan, math.inf])
def test_a_rate_that_is_no_positive_number_is_refused(rate: float) -> None:
    """A frame rate of zero, less, infinity or NaN is refused by name and value."""
    with pytest.raises(InputError, match=f"frame_rate_hz must be a positive number, got {rate}"):
        solve_pic_framewise(line(0.0, velocities=(1.0,)), frame_rate_hz=rate)


def test_a_rate_too_low_to_have_a_frame_length_is_refused() -> None:
    """A frame that would last longer than the largest float is refused, not raised as an overflow."""
    with pytest.raises(InputError, match="frame_rate_hz must be between 1.49e-154 and 6.7e153".replace("+", "[+]")):
        solve_pic_framewise(line(0.0, velocities=(1.0,)), frame_rate_hz=1e-310)
