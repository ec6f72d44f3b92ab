"""PIT compiled, for any number of discs without gravity: the run of `carom.solvers.pit.frames`, to the bit."""

from __future__ import annotations

from typing import TYPE_CHECKING

from carom.solvers.pit.frame_loop import FrameLoop
from carom.solvers.pit.run import FrameRun
from carom.solvers.plain.bodies import require_supported

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from carom.scene import Scene
    from carom.solvers.pit.clock import FrameClock

__all__ = ["CompiledLog", "CompiledRun"]

#: Tests handed to the loop at a time: some hundredths of a second, for progress and Ctrl-C.
_WORK = 2.0**23
_NO_LIMIT = 2**62


class CompiledLog:
    """The impacts of a compiled run: `carom.solvers.run.ImpactLog`."""

    def __init__(self, loop: FrameLoop) -> None:
        self._loop = loop

    def array(self, first: int = 0) -> NDArray[np.void]:
        """Return the impacts from row `first` on as a read-only array of `carom.trace.IMPACT_DTYPE`."""
        impacts = self._loop.impacts(first)
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

    Raises:
        InputError: The scene has gravity.
    """

    def __init__(self, scene: Scene, clock: FrameClock, *, skipping: bool = True) -> None:
        require_supported(scene, "compiled PIT")
        super().__init__(clock)
        self._loop = FrameLoop(scene, clock.step_s, clock.rate_hz, skipping)
        self.log = CompiledLog(self._loop)

    @property
    def frames(self) -> int:
        """Frames passed."""
        return self._loop.frames

    @property
    def impacts(self) -> int:
        """Number of impacts so far."""
        return self._loop.impact_count

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
