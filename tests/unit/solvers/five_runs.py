"""The five kinds of run, each by name: what is demanded of one is demanded of all."""

from __future__ import annotations

from collections.abc import Callable

from carom.scene import Scene
from carom.solvers.certified.options import MAX_PRECISION_BITS, TIE_BITS
from carom.solvers.event_driven.run import EventDrivenRun
from carom.solvers.falling.run import BallisticRun
from carom.solvers.pit.clock import FrameClock
from carom.solvers.pit.solve import FrameRun, pit_run
from carom.solvers.plain.run import AllPairsRun
from carom.solvers.run import Run


def certified(scene: Scene) -> Run:
    from carom.solvers.certified.run import CertifiedRun  # needs python-flint, which other kinds do without

    return CertifiedRun(scene, digits=15, max_precision_bits=MAX_PRECISION_BITS, tie_bits=TIE_BITS)


def of_frames(scene: Scene) -> Run:
    run = pit_run(scene, FrameClock(rate_hz=scene.frame_rate_hz))
    assert isinstance(run, FrameRun)  # and not one in units of its own
    return run


#: That each is a `Run` is what mypy holds them to here: a member that is missing, or of another type, is an error.
RUNS: dict[str, Callable[[Scene], Run]] = {
    "event-driven": EventDrivenRun,
    "all pairs": AllPairsRun,
    "ballistic": BallisticRun,
    "frames": of_frames,
    "certified": certified,
}
