"""What is to be run, and what came of it: the words that everything which runs engines has in common."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum
from typing import ClassVar, Generic, Protocol, TypeVar

from carom.errors import CaromError
from carom.model.scene import Scene
from carom.model.trace import Setting, profile_shown

#: Told (done, all, what) as work finishes.
Progress = Callable[[int, int, str], None]


def unheard(_done: int, _total: int, _what: str) -> None:
    """Tell nobody how far something is: the progress of who did not ask for it."""


T = TypeVar("T")
T_co = TypeVar("T_co", covariant=True)


#: Settings that are tried instead of a profile's own, by name.
Tried = tuple[tuple[str, Setting], ...]


@dataclass(frozen=True, order=True)
class Method:
    """One engine with one profile, and what is tried instead of the profile's own settings.

    Attributes:
        engine: Name of the adapter.
        profile: Name of the profile.
        tried: Settings instead of the profile's own, by name; with any, it is the profile's method no more.
    """

    engine: str
    profile: str
    tried: Tried = ()

    @property
    def profile_shown(self) -> str:
        """The profile, with what is tried in its place: what people are shown."""
        return profile_shown(self.profile, dict(self.tried))

    @property
    def name(self) -> str:
        """Engine and profile, as tables have it."""
        return f"{self.engine}/{self.profile_shown}"


#: PIT stands for sampling itself: every method is compared with it at its own step.
PIT_METHOD = Method("pit", "tuned")


@dataclass(frozen=True)
class Job:
    """What is to be run: one scene by one method at one step.

    Attributes:
        scene: The scene.
        method: Engine and profile.
        dt_s: Step, seconds.
        refinement: Which of the scene's steps this is, 0 for the coarsest, so that steps of different scenes compare.
        phase: Where in a step the scene's start falls, 0 to 1: the scene begins this fraction of a step earlier.
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
        return f"{self.engine} ({self.method.profile_shown}, dt = {self.dt_s:g} s) on {self.scene.name!r}"


@dataclass(frozen=True)
class JobTask:
    """What every task that is about one job is made of."""

    job: Job

    @property
    def engine(self) -> str:
        """Name of the adapter."""
        return self.job.engine


#: However short a run may be, an adapter may take so long to say what it is asked: its process has to start first.
LEAST_LIMIT_S = 20.0


@dataclass(frozen=True)
class AdapterTask:
    """What every task is made of that asks an adapter something, and runs nothing."""

    least_limit_s: ClassVar[float] = LEAST_LIMIT_S
    engine: str


class Status(Enum):
    """Whether a job was run; the value is the phrase shown."""

    RAN = "ran"
    UNSUPPORTED = "unsupported"
    UNAVAILABLE = "unavailable"
    CRASHED = "crashed"
    TIMED_OUT = "timed out"
    FAILED = "the adapter failed"

    @property
    def broken(self) -> bool:
        """Whether the engine, or its adapter, broke a run off: another time it may not."""
        return self in {Status.CRASHED, Status.TIMED_OUT, Status.FAILED}


@dataclass(frozen=True)
class Answer(Generic[T]):
    """What came of a task.

    Attributes:
        status: Whether it was carried out.
        reason: Why it was not, empty where it was.
        value: What was asked for; None where it was not carried out.
    """

    status: Status
    reason: str = ""
    value: T | None = None

    @property
    def said(self) -> str:
        """Status and reason in one phrase; empty where it was carried out."""
        return "" if self.status is Status.RAN else f"{self.status.value}: {self.reason}"


class Task(Protocol[T_co]):
    """Something to do with one engine: it travels to a worker process, is carried out, and its value travels back."""

    @property
    def engine(self) -> str:
        """Name of the adapter whose engine is called."""

    def carry_out(self) -> T_co:
        """Do it, in the worker process. The declared type of what it returns is what an answer is held to.

        Raises:
            UnavailableError, UnsupportedError: There is nothing that could be done; any other error is the adapter's.
        """


class UnavailableError(CaromError):
    """A task that can't be carried out since its engine is not there; the message says why, and what to do."""


class UnsupportedError(CaromError):
    """A task that can't be carried out by anybody, or not by this engine; the message is what a table shows."""
