"""What the parent and a worker process say to each other."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol, runtime_checkable

from carom.scene import Scene

__all__ = ["Failure", "Request", "Task"]


@runtime_checkable
class Task(Protocol):
    """Something else to do in a worker process: it travels there, is carried out, and its result travels back."""

    def carry_out(self) -> object:
        """Do it, in the worker process; what is raised becomes a `Failure`."""


@dataclass(frozen=True)
class Request:
    """One thing to do: observe a run (`timing_runs` is 0), or time it."""

    engine: str
    scene: Scene
    profile: str
    dt_s: float
    samples: bool = False
    timing_runs: int = 0


@dataclass(frozen=True)
class Failure:
    """The adapter raised an error; the message is what a table shows."""

    message: str
