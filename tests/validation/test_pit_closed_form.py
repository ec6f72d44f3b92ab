"""PIT of two discs has a closed form: it finds the impact at the first frame in [contact, closest), or never."""

import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from tests.cases import each, long_until
from tests.scene_builders import disc_at, staged

from carom import Scene, solve_pit

CONTACT_M = 1.0


def build_passing_scene(offset: float, advance: float, frames_to_closest: float, frame_rate_hz: float) -> Scene:
    """Stage two discs of contact distance 1 that pass each other.

    Args:
        offset: Impact parameter in contact distances.
        advance: Relative advance a frame in contact distances.
        frames_to_closest: Frames until the centres are nearest.
        frame_rate_hz: Frames per second.
    """
    speed = advance * frame_rate_hz
    start = -advance * frames_to_closest
    duration_s = (frames_to_closest + 2 + 2 / advance) / frame_rate_hz
    discs = disc_at(start, 0.0, speed), disc_at(0.0, offset)
    return staged("passing", *discs, duration_s=duration_s, frame_rate_hz=frame_rate_hz)


@given(offset=st.floats(0, 0.99), advance=st.floats(0.05, 1.5), extra=st.floats(0.1, 5))
def test_pit_normal_is_the_line_of_centres_at_its_frame(offset: float, advance: float, extra: float) -> None:
    """PIT's normal is the line of centres at its frame: atan2(offset, remaining advance)."""
    half_chord = math.sqrt(CONTACT_M**2 - offset**2) / advance
    closest = half_chord + extra
    enter = closest - half_chord
    assume(all(abs(edge - round(edge)) > 1e-9 for edge in (enter, closest)))
    frame = math.ceil(enter)
    assume(frame < closest)
    trace = solve_pit(build_passing_scene(offset, advance, closest, 60.0))
    expected = math.atan2(offset, advance * (closest - frame))
    nx, ny = trace.impacts["normal"][0]
    assert math.atan2(ny, nx) == pytest.approx(expected, abs=1e-9)


@each("advance", long_until(2, [0.3, 1.7, 0.9, 1.0, 3.0]))
@each("offset", [0.0, 0.5, 0.9])
def test_share_of_phases_missed_by_pit_matches_the_closed_form(advance: float, offset: float) -> None:
    """PIT misses a share max(0, 1 - sqrt(1 - b^2) / a) of all phases, b the offset and a the advance a frame."""
    # Only half the chord counts, because of the approach test. Phases are spread evenly, so the counted share differs
    # from the exact one by less than one phase.
    phases = 100
    half_chord = math.sqrt(CONTACT_M**2 - offset**2) / advance
    # Half a spacing off the frames themselves: no phase may decide by rounding.
    closest = half_chord + 1 + (np.arange(phases) + 0.5) / phases
    found = sum(len(solve_pit(build_passing_scene(offset, advance, c, 60.0)).impacts) > 0 for c in closest)
    assert abs((1 - found / phases) - max(0.0, 1 - half_chord)) < 1 / phases
