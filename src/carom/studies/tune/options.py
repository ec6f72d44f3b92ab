"""Options of a search for settings: see `carom.support.options`."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from carom.errors import InputError
from carom.execution.options import MOST_SEED, LimitOptions
from carom.support.escaping import shown
from carom.support.options import flag, name, option, step, whole

if TYPE_CHECKING:
    from carom.model.scene import Scene


@dataclass(frozen=True)
class TuneOptions(LimitOptions):
    """Options of a search, without its engine and scenes.

    Attributes:
        profile: The profile that the search begins with.
        dt_s: Step, seconds; by default each scene's own frame.
        trials: Number of different settings to try before the best is refined.
        seed: Seed of the optimiser's random numbers.
        timing: Whether the cost decides between equally accurate settings; jobs then run one at a time.

    Raises:
        InputError: A value makes no sense, or `timing` is asked for on a cluster.
    """

    profile: str = option("default", name(), "Profile to start from.", "--profile", "-p")
    dt_s: float | None = option(
        None, step(), "Time step in seconds, such as 1/240.", "--dt", said="one frame of each scene"
    )
    trials: int = option(100, whole(1, MOST_SEED), "Number of settings to try before the best is refined.", "--trials")
    seed: int = option(0, whole(0, 2**32 - 1), "Seed of the optimiser.", "--seed")
    timing: bool = option(
        False, flag(), "Let run time decide between equally accurate settings.", "--timing/--no-timing"
    )

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.timing and self.scheduler is not None:
            raise InputError(
                "timing needs one machine, whose run times can be compared, got the scheduler "
                f"{shown(self.scheduler)}: leave out one of the two"
            )

    def step_of(self, scene: Scene) -> float:
        """Return the step at which a scene is run, seconds."""
        return 1.0 / scene.frame_rate_hz if self.dt_s is None else self.dt_s
