"""Known answers: what must happen in a scene, from mathematics or a cited source, and how far a trace is from it."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from carom.scene import Scene
from carom.trace import Trace, Vector

__all__ = ["CatalogueScene", "KnownAnswer", "KnownImpact", "deviation"]


@dataclass(frozen=True)
class KnownImpact:
    """One impact whose answer is known; a part that is not known is None.

    Attributes:
        time_s: Seconds from the start.
        first: The disc, the lower number of two.
        second: The other disc, or the wall, ``-1 - k``.
        velocity_first_after: Metres a second.
        velocity_second_after: Metres a second.
    """

    time_s: float
    first: int
    second: int
    velocity_first_after: Vector | None = None
    velocity_second_after: Vector | None = None


@dataclass(frozen=True)
class KnownAnswer:
    """What mathematics or a cited source says of a scene. It is never computed by the code that it is to test.

    Attributes:
        source: Where the answer comes from: the theorem, the closed form or the citation, in one sentence.
        impacts: The first impacts of the scene, in order; all of them where `count` equals their number.
        count: How many impacts the scene has in its duration, where that is known.
        final_velocity_m_s: Final velocity of each disc, where known.
        final_position_m: Final position of each disc, where known.
        convention: Why the scene has no unique answer; empty where it has one.
    """

    source: str
    impacts: tuple[KnownImpact, ...] = ()
    count: int | None = None
    final_velocity_m_s: tuple[Vector, ...] | None = None
    final_position_m: tuple[Vector, ...] | None = None
    convention: str = ""


@dataclass(frozen=True)
class CatalogueScene:
    """A scene of the catalogue.

    Attributes:
        scene: The scene; its name is ``group/name``.
        shows: What it shows, in one sentence.
        known: Its known answer.
        tags: Words to choose scenes by.
    """

    scene: Scene
    shows: str
    known: KnownAnswer
    tags: frozenset[str] = field(default_factory=frozenset)

    @property
    def name(self) -> str:
        """Full name, ``group/name``."""
        return self.scene.name

    @property
    def group(self) -> str:
        """The part before the stroke."""
        return self.scene.name.partition("/")[0]


def deviation(trace: Trace, known: KnownAnswer, scene: Scene) -> float:
    """Return the largest deviation of a trace from the known answer; infinite where an impact is missing or wrong.

    Times are divided by the scene's duration, velocities by the greatest speed known, positions by the greatest extent
    of the start, so that the figure has no unit.
    """
    if known.count is not None and len(trace.impacts) != known.count:
        return math.inf
    if len(trace.impacts) < len(known.impacts):
        return math.inf
    speed = max(math.hypot(*disc.velocity_m_s) for disc in scene.discs) or 1.0
    extent = max(abs(c) + disc.radius_m for disc in scene.discs for c in disc.position_m)
    worst = 0.0
    for expected, found in zip(known.impacts, trace.impacts, strict=False):
        if (expected.first, expected.second) != (found["first"], found["second"]):
            return math.inf
        worst = max(worst, abs(expected.time_s - float(found["time_s"])) / scene.duration_s)
        for velocity, name in (
            (expected.velocity_first_after, "velocity_first_after"),
            (expected.velocity_second_after, "velocity_second_after"),
        ):
            if velocity is not None:
                worst = max(worst, float(np.max(np.abs(found[name] - velocity))) / speed)
    if known.final_velocity_m_s is not None:
        worst = max(worst, float(np.max(np.abs(trace.final_velocity_m_s - known.final_velocity_m_s))) / speed)
    if known.final_position_m is not None:
        worst = max(worst, float(np.max(np.abs(trace.final_position_m - known.final_position_m))) / extent)
    return worst
