"""A clock for modules that read `time`, so that no test depends on the speed of the machine."""

from collections.abc import Callable


class Clock:
    """Replaces the module `time` in a module under test, and advances only by request.

    Args:
        tick_s: Seconds that pass with each reading.
        factor: What the tick is multiplied by after each reading.
        starts: No time passes until this returns true: that an engine has begun to hang, say.

    Attributes:
        now_s: What the next reading returns, in seconds; a test may change it.
    """

    def __init__(self, tick_s: float = 0.0, factor: float = 1.0, starts: Callable[[], bool] = lambda: True) -> None:
        self.now_s = 1000.0
        self._tick_s, self._factor, self._starts = tick_s, factor, starts

    def perf_counter(self) -> float:
        """Return the time, in seconds."""
        now_s = self.now_s
        if self._starts():
            self.now_s += self._tick_s
            self._tick_s *= self._factor
        return now_s

    monotonic = perf_counter
