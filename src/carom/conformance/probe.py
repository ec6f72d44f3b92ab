"""What the suite asks of a worker process beyond whole runs: to look closely, to be refused, to make many worlds."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from carom.adapter import Observation
from carom.scene import Scene
from carom.trace import Setting

__all__ = ["Cut", "Grown", "Make", "Raised", "Watch", "Watched"]


@dataclass(frozen=True)
class Watch:
    """Run a scene to its end and hand over every observation.

    Attributes:
        engine: Name of the adapter.
        scene: The scene.
        settings: The settings to prepare it with.
        steps: How many steps.
        looks: How often to observe after each step; 0 takes all steps in one call and looks at the end alone.
    """

    engine: str
    scene: Scene
    settings: Mapping[str, Setting]
    steps: int
    looks: int = 1


@dataclass(frozen=True)
class Cut:
    """Run a scene to its end in steps each of which is cut, as for a profile that is located, and hand over each state.

    Attributes:
        engine: Name of the adapter.
        scene: The scene.
        settings: The settings to prepare it with.
        dt_s: Length of each step, seconds.
        steps: How many.
        disturbed: Whether before each step one of three times the length is tried and taken back, and after each the
            world is asked what touches.
    """

    engine: str
    scene: Scene
    settings: Mapping[str, Setting]
    dt_s: float
    steps: int
    disturbed: bool


@dataclass(frozen=True)
class Watched:
    """What was seen.

    Attributes:
        settings: The world's settings after its steps.
        seen: Observations: at the start, and after each step (the last look of each), or at the end.
        altered: Number of the first observation that a later step altered; None where each stayed as it was.
    """

    settings: Mapping[str, Setting]
    seen: tuple[Observation, ...]
    altered: int | None


@dataclass(frozen=True)
class Make:
    """Make, step once, and close so many worlds, and tell by how many bytes the process has grown since the first ten.

    Attributes:
        engine: Name of the adapter.
        scene: The scene.
        settings: The settings to prepare it with.
        worlds: How many.
        step: Whether to take a step and look before closing.
    """

    engine: str
    scene: Scene
    settings: Mapping[str, Setting]
    worlds: int
    step: bool = True


@dataclass(frozen=True)
class Grown:
    """Growth of the resident memory, bytes; None where the system does not tell."""

    bytes: int | None


@dataclass(frozen=True)
class Raised:
    """The adapter raised an error.

    Attributes:
        where: The call that raised it: ``prepare``, ``advance``, ``observe``, ``settings``, ``cut`` or ``close``.
        kind: Name of its class.
        deliberate: Whether it is an `AdapterError` or another of Carom's.
        message: What it says.
    """

    where: str
    kind: str
    deliberate: bool
    message: str
