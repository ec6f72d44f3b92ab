"""A PIT run that is advanced in pieces, observed and interrupted ends with the same bits, in both forms."""

import signal
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

import pytest
from tests.scene_builders import build_line_scene, disc_at, staged, wall_at
from tests.unit.solvers.pit.run_forms import Form, collect_bits, list_compiled_forms, run_to_end, start_plain_run

from carom.model.scene import Scene
from carom.model.trace import Outcome
from carom.solvers.pit.clock import FrameClock
from carom.studies.bench.gas import build_gas_scene

CLOCK = FrameClock(rate_hz=24.0)


def list_forms() -> dict[str, Form]:
    return {"plain": start_plain_run, **list_compiled_forms()}


@pytest.fixture(params=list_forms())
def form(request: pytest.FixtureRequest) -> Form:
    return list_forms()[request.param]


def build_billiard() -> Scene:
    """Three discs in a box; the impacts of one frame are several now and then."""
    return staged(
        "billiard",
        disc_at(1.0, 1.0, 9.0, 7.0),
        disc_at(3.0, 1.5, -8.0, 1.0, r=0.4, m=2.0),
        disc_at(2.0, 3.0, 1.0, -9.0, r=0.3),
        *[wall_at(p, p, *normal) for p, normal in ((0, (1, 0)), (0, (0, 1)), (4, (-1, 0)), (4, (0, -1)))],
        duration_s=10.0,
    )


def test_advancing_by_frames_equals_advancing_to_a_time(form: Form) -> None:
    """Advancing by 8 frames of 0.25 s equals advancing to 2 s; the frame at 2 s is tested by the next advance."""
    scene = build_line_scene(0.0, 3.0, velocities=(1.0, 0.0))
    by_frames, by_time = form(scene, FrameClock(step_s=0.25)), form(scene, FrameClock(step_s=0.25))
    by_frames.advance_frames(8)
    by_time.advance_to(2.0)
    assert by_frames.time_s == by_time.time_s == 2.0
    assert collect_bits(by_frames) == collect_bits(by_time)
    assert len(by_frames.log) == 0
    by_frames.advance_frames(1)
    assert by_frames.log.array()["time_s"].tolist() == [2.0]


def test_impact_limit_ends_the_run_after_a_whole_frame(form: Form) -> None:
    """An impact limit ends the run after the whole frame that reaches it; the run then continues with equal bits."""
    scene = build_billiard()
    whole = run_to_end(scene, CLOCK, form).log.array()
    shared = next(k for k in range(10, len(whole)) if whole["time_s"][k] == whole["time_s"][k - 1])
    run = form(scene, CLOCK)
    assert run.advance_to(10.0, max_impacts=shared) is Outcome.MAX_IMPACTS
    assert run.time_s == whole["time_s"][shared]
    assert run.log.array().tobytes() == whole[whole["time_s"] <= run.time_s].tobytes()
    assert run.advance_to(10.0, max_impacts=10**9) is Outcome.COMPLETED
    assert collect_bits(run) == collect_bits(run_to_end(scene, CLOCK, form))


def test_impact_limit_of_zero_runs_no_frame(form: Form) -> None:
    """With a limit of 0 impacts no frame is run; a run without remaining frames completes at any limit."""
    run = form(build_billiard(), CLOCK)
    assert run.advance_to(10.0, max_impacts=0) is Outcome.MAX_IMPACTS
    assert (run.time_s, run.frames) == (0.0, 0)
    assert run.advance_to(0.0, max_impacts=0) is Outcome.COMPLETED


def test_progress_reports_impacts_and_time(form: Form) -> None:
    """Progress reports impacts and times that never decrease and end with those of the last frame."""
    seen: list[tuple[int, float]] = []
    run = form(build_billiard(), CLOCK)
    run.advance_to(10.0, progress=lambda impacts, time_s: seen.append((impacts, time_s)))
    assert seen == sorted(seen)
    assert seen[-1] == (len(run.log), CLOCK.time_s(239))


class StopError(Exception):
    """Raised by a signal's handler, as Ctrl-C raises KeyboardInterrupt."""


@contextmanager
def interrupt_soon() -> Iterator[None]:
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
def test_interrupted_run_continues_with_the_same_bits(form: Form) -> None:
    """A signal stops a run of 2,000,000 frames before its end; the run then continues with equal bits."""
    scene = build_gas_scene(300, 0.3)
    run = form(scene, CLOCK)
    with pytest.raises(StopError), interrupt_soon():
        run.advance_frames(2_000_000)
    assert run.frames < 2_000_000
    if form is start_plain_run:  # interrupted in the middle of a frame, for all that it knows
        return
    frames = run.frames + 10
    run.advance_frames(10)
    whole = form(scene, CLOCK)
    whole.advance_frames(frames)
    assert collect_bits(run) == collect_bits(whole)


@pytest.mark.long
def test_other_threads_run_during_compiled_frames() -> None:
    """While compiled code runs 200 frames, another thread can read how many are done."""
    from carom.core.pit import FrameLoop

    loop = FrameLoop(build_gas_scene(300, 0.3), CLOCK, False, 0.0)
    thread = threading.Thread(target=loop.run, args=(200, 2**62, 1e18))
    thread.start()
    seen = set()
    while thread.is_alive():
        seen.add(loop.frames)
    thread.join()
    assert any(0 < frames < 200 for frames in seen)
