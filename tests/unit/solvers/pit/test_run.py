"""A PIT run that is advanced in pieces, observed and interrupted ends with the same bits, in both forms."""

import signal
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

import pytest
from tests.cases import each
from tests.scene_builders import disc_at, line, staged
from tests.unit.solvers.pit.run_forms import Form, bits, compiled_forms, finished, plain

from carom.errors import InputError
from carom.model.scene import Scene, Wall
from carom.model.trace import Outcome
from carom.solvers.pit.clock import FrameClock
from carom.studies.bench.gas import build_gas_scene

CLOCK = FrameClock(rate_hz=24.0)


def forms() -> dict[str, Form]:
    return {"plain": plain, **compiled_forms()}


@pytest.fixture(params=forms())
def form(request: pytest.FixtureRequest) -> Form:
    return forms()[request.param]


def billiard() -> Scene:
    """Three discs in a box; the impacts of one frame are several now and then."""
    return staged(
        "billiard",
        disc_at(1.0, 1.0, 9.0, 7.0),
        disc_at(3.0, 1.5, -8.0, 1.0, r=0.4, m=2.0),
        disc_at(2.0, 3.0, 1.0, -9.0, r=0.3),
        *[Wall(point_m=(p, p), normal=normal) for p, normal in ((0, (1, 0)), (0, (0, 1)), (4, (-1, 0)), (4, (0, -1)))],
        duration_s=10.0,
    )


def test_a_state_between_frames_is_that_of_free_flight(form: Form) -> None:
    """Between two frames discs are where their velocities take them from the frame before."""
    run = form(line(0.0, 9.0, velocities=(1.0, -2.0)), FrameClock(rate_hz=4.0))
    run.advance_to(0.625)
    assert run.time_s == 0.625
    assert run.positions()[:, 0].tolist() == [0.625, 7.75]


def test_frames_and_times_come_to_the_same(form: Form) -> None:
    """The frames lead to the instant of the next one, which has not been tested yet."""
    scene = line(0.0, 3.0, velocities=(1.0, 0.0))
    by_frames, by_time = form(scene, FrameClock(step_s=0.25)), form(scene, FrameClock(step_s=0.25))
    by_frames.advance_frames(8)
    by_time.advance_to(2.0)
    assert by_frames.time_s == by_time.time_s == 2.0
    assert bits(by_frames) == bits(by_time)
    assert len(by_frames.log) == 0
    by_frames.advance_frames(1)
    assert by_frames.log.array()["time_s"].tolist() == [2.0]


def test_no_frames_change_nothing(form: Form) -> None:
    """A run is not taken back, neither by no frames nor by an earlier time."""
    run = form(billiard(), CLOCK)
    run.advance_to(1.0)
    before = bits(run)
    run.advance_frames(0)
    run.advance_to(0.5)
    assert run.time_s == 1.0
    assert bits(run) == before


def test_a_limit_ends_the_run_after_the_frame_that_reaches_it(form: Form) -> None:
    """Frames are taken whole, up to the first that reaches the number of impacts; the rest goes on from there."""
    scene = billiard()
    whole = finished(scene, CLOCK, form).log.array()
    shared = next(k for k in range(10, len(whole)) if whole["time_s"][k] == whole["time_s"][k - 1])
    run = form(scene, CLOCK)
    assert run.advance_to(10.0, max_impacts=shared) is Outcome.MAX_IMPACTS
    assert run.time_s == whole["time_s"][shared]
    assert run.log.array().tobytes() == whole[whole["time_s"] <= run.time_s].tobytes()
    assert run.advance_to(10.0, max_impacts=10**9) is Outcome.COMPLETED
    assert bits(run) == bits(finished(scene, CLOCK, form))


def test_a_limit_that_is_reached_already_passes_no_frame(form: Form) -> None:
    """With no impacts to be had no frame is passed; where none is left the run is complete whatever the limit."""
    run = form(billiard(), CLOCK)
    assert run.advance_to(10.0, max_impacts=0) is Outcome.MAX_IMPACTS
    assert (run.time_s, run.frames) == (0.0, 0)
    assert run.advance_to(0.0, max_impacts=0) is Outcome.COMPLETED


def test_progress_is_told_impacts_and_time(form: Form) -> None:
    """Impacts and times never fall, and the last are those of the last frame."""
    seen: list[tuple[int, float]] = []
    run = form(billiard(), CLOCK)
    run.advance_to(10.0, progress=lambda impacts, time_s: seen.append((impacts, time_s)))
    assert seen == sorted(seen)
    assert seen[-1] == (len(run.log), CLOCK.time_s(239))


@each("time_s", [-1.0, float("nan"), float("inf")])
def test_a_time_that_is_none_is_refused(form: Form, time_s: float) -> None:
    """There is no end to frames before infinity."""
    with pytest.raises(InputError, match="time_s must be"):
        form(billiard(), CLOCK).advance_to(time_s)


class StopError(Exception):
    """Raised by a signal's handler, as Ctrl-C raises KeyboardInterrupt."""


@contextmanager
def interrupted_soon() -> Iterator[None]:
    def interrupt(_number: int, frame: FrameType | None) -> None:
        if frame is not None and "coverage" in frame.f_code.co_filename:  # raised there, it would leave a lock held
            signal.setitimer(signal.ITIMER_REAL, 0.001)
            return
        raise StopError

    before = signal.signal(signal.SIGALRM, interrupt)
    signal.setitimer(signal.ITIMER_REAL, 0.02)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)


@pytest.mark.skipif(sys.platform == "win32", reason="has no timer that signals")
def test_a_long_run_can_be_interrupted_and_goes_on(form: Form) -> None:
    """What would take a minute ends soon after the signal; afterwards the run ends as if nothing had happened."""
    scene = build_gas_scene(300, 0.3)
    run = form(scene, CLOCK)
    with pytest.raises(StopError), interrupted_soon():
        run.advance_frames(2_000_000)
    assert run.frames < 2_000_000
    if form is plain:  # interrupted in the middle of a frame, for all that it knows
        return
    frames = run.frames + 10
    run.advance_frames(10)
    whole = form(scene, CLOCK)
    whole.advance_frames(frames)
    assert bits(run) == bits(whole)


@pytest.mark.long
def test_other_threads_run_meanwhile() -> None:
    """While compiled code passes frames, another thread sees how many it has passed."""
    from carom.core.pit import FrameLoop

    loop = FrameLoop(build_gas_scene(300, 0.3), CLOCK, False, 0.0)
    thread = threading.Thread(target=loop.run, args=(200, 2**62, 1e18))
    thread.start()
    seen = set()
    while thread.is_alive():
        seen.add(loop.frames)
    thread.join()
    assert any(0 < frames < 200 for frames in seen)
