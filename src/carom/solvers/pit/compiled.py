"""PIT compiled, for any number of discs without gravity: the run of `carom.solvers.pit.frames`, to the bit."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from carom.solvers.pit import frame_loop
from carom.solvers.pit.run import FrameRun
from carom.solvers.plain.bodies import require_supported
from carom.trace import IMPACT_DTYPE

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from carom.scene import Scene
    from carom.solvers.pit.clock import FrameClock

__all__ = ["PATIENCE", "CompiledLog", "CompiledRun"]

#: Tests handed to the loop at a time: some hundredths of a second, for progress and Ctrl-C.
_WORK = 2.0**23
_NO_LIMIT = 2**62

#: It is done at the start, and once more where bounds have run out: chosen, not tuned.
PATIENCE = 2.0


class CompiledLog:
    """The impacts of a compiled run: `carom.solvers.run.ImpactLog`."""

    def __init__(self, loop: frame_loop.FrameLoop) -> None:
        self._loop = loop
        self._room = np.empty(0, IMPACT_DTYPE)
        self._copied = 0

    def __len__(self) -> int:
        return self._loop.recorded

    def array(self) -> NDArray[np.void]:
        """Return the impacts so far as a read-only array of `carom.trace.IMPACT_DTYPE`, in the order of their tests.

        What was copied at an earlier call is not copied again, or seldom: the room for it doubles where it ends.
        """
        count = self._loop.recorded
        if count > len(self._room):
            old, self._room = self._room, np.empty(max(count, 2 * len(self._room)), IMPACT_DTYPE)
            self._room[: self._copied] = old[: self._copied]
        if count > self._copied:
            self._loop.copy_impacts(self._copied, self._room[self._copied : count].view(np.int8))
            self._copied = count
        impacts = self._room[:count]
        impacts.flags.writeable = False
        return impacts

    def ambiguous(self) -> tuple[int, ...]:
        """Return the rows that share a movable disc with an earlier impact of the same frame."""
        return self._loop.ambiguous()


class CompiledRun(FrameRun):
    """A PIT run of compiled code, which leaves out the tests that can find nothing.

    Args:
        scene: The scene.
        clock: When the frames are.
        skipping: Whether to leave them out. Where the discs are so crowded that it does not pay, they are made.
        patience: How many times the work of looking around all discs once may be wasted before it counts as not paying.

    Raises:
        InputError: The scene has gravity.
    """

    def __init__(self, scene: Scene, clock: FrameClock, *, skipping: bool = True, patience: float = PATIENCE) -> None:
        require_supported(scene, "compiled PIT")
        super().__init__(clock)
        self._loop = frame_loop.FrameLoop(scene.arrays, clock.step_s, clock.rate_hz, skipping, patience)
        self.log = CompiledLog(self._loop)

    @property
    def frames(self) -> int:
        """Frames passed."""
        return self._loop.frames

    @property
    def counts(self) -> dict[str, int]:
        """Work so far; a test that a bound has made needless counts as made where the bound was found."""
        loop = self._loop
        return {
            "frames": loop.frames,
            "frames_looked_at": loop.frames_looked_at,
            "frames_skipped": loop.frames - loop.frames_looked_at,
            "pair_tests": loop.pair_tests,
        }

    def pass_frames(self, until: int, max_impacts: int | None) -> None:
        """Pass frames in compiled code, other threads running meanwhile."""
        self._loop.run(until, _NO_LIMIT if max_impacts is None else max_impacts, _WORK)

    def positions(self) -> NDArray[np.float64]:
        """Centres now, metres, shape ``(n, 2)``."""
        return self._loop.positions(self.time_s)

    def velocities(self) -> NDArray[np.float64]:
        """Velocities now, metres a second, shape ``(n, 2)``."""
        return self._loop.velocities()
