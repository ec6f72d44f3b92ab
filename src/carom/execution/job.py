"""Types that several modules for engine runs use: `Method`, `Job`, `Task`, `Status` and `Answer`."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum
from typing import ClassVar, Generic, Protocol, TypeVar

from carom.errors import CaromError
from carom.model.scene import Scene
from carom.model.trace import Setting, format_profile, resolve_profile

#: Function that is called with (done, total, description) as work finishes.
Progress = Callable[[int, int, str], None]


def no_progress(_done: int, _total: int, _what: str) -> None:
    """Do nothing. This function is the default of every `Progress` argument."""


#: Type of the value of a task.
T = TypeVar("T")
T_co = TypeVar("T_co", covariant=True)


#: Settings that are used instead of a profile's settings, as pairs of name and value.
SettingOverrides = tuple[tuple[str, Setting], ...]


@dataclass(frozen=True, order=True)
class Method:
    """An engine with one of its profiles, optionally with some settings replaced.

    Attributes:
        engine: Name of the adapter.
        profile: Name of the profile. An alias is replaced by the profile's name.
        overrides: Settings that are used instead of the profile's settings. Methods with different values of
            `overrides` are different methods.
    """

    engine: str
    profile: str
    overrides: SettingOverrides = ()

    def __post_init__(self) -> None:
        object.__setattr__(self, "profile", resolve_profile(self.engine, self.profile))

    @property
    def profile_shown(self) -> str:
        """The profile and the settings in `overrides`, for display."""
        return format_profile(self.engine, self.profile, dict(self.overrides))

    @property
    def label(self) -> str:
        """Engine and profile, for tables."""
        return f"{self.engine} {self.profile_shown}".rstrip()

    @property
    def is_own(self) -> bool:
        """Whether this is PIC or PIT, the methods of Carom with which engines are compared."""
        return self.engine in {"pic", "pit"}

    @property
    def heading(self) -> str:
        """The engine's name in headings: PIC, PIT, or the adapter's name."""
        return self.engine.upper() if self.is_own else self.engine

    @property
    def title(self) -> str:
        """Engine and profile, with the engine's name as in headings."""
        return f"{self.heading} {self.profile_shown}".rstrip()

    @property
    def phrase(self) -> str:
        """Engine with the profile in parentheses, for sentences."""
        return f"{self.engine} ({self.profile_shown})" if self.profile_shown else self.engine

    @property
    def name(self) -> str:
        """Engine and profile, for files."""
        return f"{self.engine}/{self.profile_shown or self.profile}"


#: PIT as a method. Every method is compared with PIT at the same step size, since all errors of PIT come from checking
#: once per step.
PIT_METHOD = Method("pit", "tuned")


@dataclass(frozen=True)
class Job:
    """A run of a scene by a method with a step size.

    Attributes:
        scene: The scene.
        method: Engine and profile.
        dt_s: Step size, in seconds.
        refinement: Index of the step size in the scene's list of step sizes, where 0 is the largest step size. Studies
            compare results of different scenes that have the same index.
        phase: Fraction of a step, 0 to 1, by which the scene begins earlier.
    """

    scene: Scene
    method: Method
    dt_s: float
    refinement: int = 0
    phase: float = 0.0

    @property
    def engine(self) -> str:
        """Name of the adapter."""
        return self.method.engine

    @property
    def profile(self) -> str:
        """Name of the profile."""
        return self.method.profile

    def __str__(self) -> str:
        profile_and_step = (self.method.profile_shown, f"dt = {self.dt_s:g} s")
        return f"{self.engine} ({', '.join(filter(None, profile_and_step))}) on {self.scene.name!r}"


@dataclass(frozen=True)
class JobTask:
    """Base class of the tasks that run one job."""

    job: Job

    @property
    def engine(self) -> str:
        """Name of the adapter."""
        return self.job.engine


#: Smallest time limit of a query of an adapter, in seconds, including the start of the process. For runs, users may set
#: a shorter time limit.
MIN_TIME_LIMIT_S = 20.0


@dataclass(frozen=True)
class AdapterTask:
    """Base class of the tasks that query an adapter and run no scene."""

    min_time_limit_s: ClassVar[float] = MIN_TIME_LIMIT_S
    engine: str


class Status(Enum):
    """Whether a task was carried out. Tables show the values of the members."""

    RAN = "ran"
    UNSUPPORTED = "unsupported"
    UNAVAILABLE = "unavailable"
    CRASHED = "crashed"
    TIMED_OUT = "timed out"
    FAILED = "the adapter failed"

    @property
    def is_failure(self) -> bool:
        """Whether the engine or its adapter failed, so that a second attempt may succeed."""
        return self in {Status.CRASHED, Status.TIMED_OUT, Status.FAILED}


@dataclass(frozen=True)
class Answer(Generic[T]):
    """The outcome of a task: its value, or the reason why there is no value.

    Attributes:
        status: Whether the task was carried out.
        reason: Reason why the task was not carried out; empty after success.
        value: The value of the task; None if the task was not carried out.
    """

    status: Status
    reason: str = ""
    value: T | None = None

    @property
    def problem(self) -> str:
        """Status and reason in one phrase; empty if the task was carried out."""
        return "" if self.status is Status.RAN else f"{self.status.value}: {self.reason}"


class Task(Protocol[T_co]):
    """A piece of work with one engine. A worker process carries out the task, and sends the value back."""

    @property
    def engine(self) -> str:
        """Name of the adapter whose engine is called."""

    def carry_out(self) -> T_co:
        """Carry out the task in the worker process. The value must have the declared return type.

        Raises:
            UnavailableError, UnsupportedError: The task can't be carried out. Any other exception counts as an error of
                the adapter.
        """


class UnavailableError(CaromError):
    """The engine of a task is not available. The message contains the reason and the remedy."""


class UnsupportedError(CaromError):
    """A task is not possible at all, or not with this engine. Tables show the message."""
