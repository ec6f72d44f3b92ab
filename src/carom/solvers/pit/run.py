"""What both forms of a PIT run share: going on from frame to frame, in as many pieces as one likes."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import TYPE_CHECKING

import numpy as np

from carom.extension import Patience
from carom.trace import Outcome

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from carom.solvers.pit.clock import FrameClock
    from carom.solvers.run import ImpactLog, Progress

__all__ = ["FrameRun"]


class FrameRun(ABC):
    """A PIT run in progress: `carom.solvers.run.Run`.

    The discs stand where the last frame passed left them, and what is asked of another time is computed from there:
    so pieces that end between frames change no bit.

    Attributes:
        clock: When the frames are.
        time_s: How far the run has been taken, seconds from the start.
        notes: What a user should know of how the run was done.
    """

    log: ImpactLog

    def __init__(self, clock: FrameClock) -> None:
        self.clock = clock
        self.time_s = 0.0
        self.notes: tuple[str, ...] = ()

    @property
    @abstractmethod
    def frames(self) -> int:
        """Frames passed: tested, or skipped because nothing could be found at them."""

    @property
    @abstractmethod
    def counts(self) -> dict[str, int]:
        """Work so far."""

    @abstractmethod
    def positions(self) -> NDArray[np.float64]:
        """Return the centres now, metres, shape ``(n, 2)``."""

    @abstractmethod
    def velocities(self) -> NDArray[np.float64]:
        """Return the velocities now, metres a second, shape ``(n, 2)``."""

    @abstractmethod
    def pass_frames(self, until: int, max_impacts: int | None) -> None:
        """Pass frames before number `until`, no more than take some hundredths of a second.

        Args:
            until: Number of a frame that has not been passed yet.
            max_impacts: Number of impacts from which on no other frame is begun; None for no limit.
        """

    def advance_to(self, time_s: float, max_impacts: int | None = None, progress: Progress | None = None) -> Outcome:
        """Pass every frame before `time_s`, or until there have been `max_impacts` in all.

        A frame at `time_s` itself comes after it; and a frame is taken whole, so its impacts may be more than were
        asked for.

        Args:
            time_s: Seconds from the start.
            max_impacts: Number of impacts, counted from the start of the run; None for no limit.
            progress: Called now and then with the number of impacts so far and the time reached.

        Raises:
            InputError: The time is not a finite number, 0 or more.
        """
        outcome = self._advance(self.clock.frames_before(time_s), max_impacts, progress)
        reached_s = time_s if outcome is Outcome.COMPLETED else self._last_frame_s
        self.time_s = max(self.time_s, reached_s)
        return outcome

    def impacts_per_disc(self) -> NDArray[np.int64]:
        """Return the number of impacts of each disc so far, with discs and walls, shape ``(n,)``."""
        impacts = self.log.array()
        bodies = np.concatenate([impacts["first"], impacts["second"]])
        return np.bincount(bodies[bodies >= 0], minlength=len(self.positions()))

    def advance_frames(self, frames: int) -> None:
        """Pass so many frames, and go to the instant of the one that follows."""
        self._advance(self.frames + frames, None, None)
        self.time_s = max(self.time_s, self.clock.time_s(self.frames))

    @property
    def _last_frame_s(self) -> float:
        """Instant of the frame that was passed last."""
        return self.clock.time_s(max(0, self.frames - 1))

    def _advance(self, until: int, max_impacts: int | None, progress: Progress | None) -> Outcome:
        patience = Patience()
        while self.frames < until:
            if max_impacts is not None and len(self.log) >= max_impacts:
                return Outcome.MAX_IMPACTS
            self.pass_frames(until, max_impacts)
            if progress is not None:
                progress(len(self.log), self._last_frame_s)
            if self.notes:  # of what would have been faster
                patience.look()
        return Outcome.COMPLETED
