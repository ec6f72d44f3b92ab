"""Types of the catalogue: scenes and known answers. Also computes how much a trace deviates from an answer."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cached_property
from types import ModuleType
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from carom.model.energy import kinetic_energy
from carom.model.scene import Scene, Wall
from carom.model.trace import Trace, Vector
from carom.model.walls import move_wall


@dataclass(frozen=True)
class KnownImpact:
    """An impact with its known time and its known velocities and spins afterwards. Unknown values are None.

    Attributes:
        time_s: Time of the impact, in seconds from the start.
        first: Number of the disc; if two discs meet, the lower of their numbers.
        second: Number of the other disc, or of the wall (`wall_body`).
        velocity_first_after: Velocity of the first body after the impact, in metres per second.
        velocity_second_after: Velocity of the second body after the impact, in metres per second; None for a wall.
        spin_first_after: Spin of the first body after the impact, in radians per second; None if unknown, or if no disc
            spins.
        spin_second_after: Spin of the second body after the impact, in radians per second; None if unknown, or if
            no disc spins.
    """

    time_s: float
    first: int
    second: int
    velocity_first_after: Vector | None = None
    velocity_second_after: Vector | None = None
    spin_first_after: float | None = None
    spin_second_after: float | None = None


@dataclass(frozen=True)
class KnownAnswer:
    """Answer of a scene, from mathematics or from a cited source, never from the tested code.

    The result of a run agrees with the answer only if no bodies overlap at the end.

    Attributes:
        source: Source of the answer, in one sentence: a theorem, a formula or a citation.
        impacts: The first impacts of the scene, in order. The list is complete if it has `count` impacts.
        count: Number of impacts in the scene's duration, if known.
        final_velocity_m_s: Final velocity of each disc, if known.
        final_position_m: Final position of each disc, if known.
        final_kinetic_energy_j: Final kinetic energy of all movable discs, if known.
        final_spin_rad_s: Final spin of each disc, if known.
        convention: Why physics allows several answers, and by which rule this answer was chosen. Empty if physics
            allows only one answer.
    """

    source: str
    impacts: tuple[KnownImpact, ...] = ()
    count: int | None = None
    final_velocity_m_s: tuple[Vector, ...] | None = None
    final_position_m: tuple[Vector, ...] | None = None
    final_kinetic_energy_j: float | None = None
    convention: str = ""
    final_spin_rad_s: tuple[float, ...] | None = None


class Staged(NamedTuple):
    """A scene with its known answer.

    One function builds the scene and its answer, because the same few numbers determine both.
    """

    scene: Scene
    known: KnownAnswer


#: Function that builds a scene and its known answer. The name of the function is the name of the scene in its group,
#: and its docstring is the scene's description.
Builder = Callable[[], Staged]


@dataclass(frozen=True)
class CatalogueScene:
    """Entry of the catalogue. The scene is built when it is first used, so that listing the catalogue is fast.

    Attributes:
        name: Full name of the entry and of its scene, ``group/name``.
        shows: The scene's description, in one sentence.
        build: Function that builds the scene and its answer.
    """

    name: str
    shows: str
    build: Builder

    @cached_property
    def _staged(self) -> Staged:
        scene, known = self.build()
        return Staged(scene.model_copy(update={"name": self.name, "description": self.shows}), known)

    @property
    def scene(self) -> Scene:
        """The scene, validated."""
        return self._staged.scene

    @property
    def known(self) -> KnownAnswer:
        """The known answer."""
        return self._staged.known

    @property
    def group(self) -> str:
        """The group of the scene: the part of its name before the slash."""
        return self.name.partition("/")[0]


def list_scenes(module: ModuleType) -> Iterator[CatalogueScene]:
    """Yield the scenes of a module in the order of their definition. Reports use the same order.

    Each private function without parameters that returns `Staged` builds a scene. The first word of the module's name
    is the group.
    """
    group = module.__name__.rpartition(".")[2].partition("_")[0]
    for name, build in vars(module).items():
        hints = getattr(build, "__annotations__", None)
        if name.startswith("_") and hints in ({"return": "Staged"}, {"return": Staged}):
            description = " ".join((build.__doc__ or "").split())
            yield CatalogueScene(f"{group}/{name[1:].replace('_', '-')}", description, build)


def deviation(trace: Trace, known: KnownAnswer, scene: Scene) -> float:
    """Return the largest deviation of a trace from the known answer; infinite if an impact is missing or wrong.

    A deviation in time is divided by the scene's duration, and a deviation in velocity by the greatest speed at the
    start or in the answer. Deviations in position, and overlaps at the end, are divided by the size of the scene at the
    start. A deviation in energy is divided by the known energy. NaN counts as an infinite deviation. If the answer has
    a `convention`, a deviation can also mean that the engine follows another rule.
    """
    if known.count is not None and len(trace.impacts) != known.count:
        return math.inf
    bodies = [(impact.first, impact.second) for impact in known.impacts]
    if bodies != trace.impacts[["first", "second"]][: len(bodies)].tolist():
        return math.inf
    values = _list_values(trace, known, scene)
    deviations = (_compute_difference(found, right, scale) for found, right, scale in values if right is not None)
    return max(*deviations, compute_deepest_overlap(trace, scene) / _compute_extent(scene), 0.0)


def _list_values(trace: Trace, known: KnownAnswer, scene: Scene) -> Iterator[tuple[ArrayLike, ArrayLike | None, float]]:
    """Yield each value of a trace, its known value and the number by which their difference is divided.

    A spin that is not reported counts as infinite.
    """
    velocities = [disc.velocity_m_s for disc in scene.discs]
    for impact in known.impacts:
        velocities += filter(None, (impact.velocity_first_after, impact.velocity_second_after))
    speed = max(math.hypot(*velocity) for velocity in velocities) or 1.0
    yield trace.final_velocity_m_s, known.final_velocity_m_s, speed
    yield trace.final_position_m, known.final_position_m, _compute_extent(scene)
    for k, (expected, found) in enumerate(zip(known.impacts, trace.impacts, strict=False)):
        yield found["time_s"], expected.time_s, scene.duration_s
        for side, body in (("first", expected.first), ("second", expected.second)):
            velocity = f"velocity_{side}_after"
            yield found[velocity], getattr(expected, velocity), speed
            if (spin := getattr(expected, f"spin_{side}_after")) is not None:
                found_spin = math.inf if trace.spins is None else trace.spins[f"{side}_after"][k]
                yield found_spin, spin, speed / scene.discs[body].radius_m
    if (energy := known.final_kinetic_energy_j) is not None:
        yield kinetic_energy(scene, trace.final_velocity_m_s), energy, energy
    if known.final_spin_rad_s is not None:
        radius = scene.arrays.radius_m
        spins = math.inf if trace.final_spin_rad_s is None else trace.final_spin_rad_s
        yield radius * spins, radius * known.final_spin_rad_s, speed


def _compute_difference(actual: ArrayLike, expected: ArrayLike, scale: float) -> float:
    difference = float(np.max(np.abs(np.asarray(actual, dtype=np.float64) - np.asarray(expected)))) / scale
    # Comparisons with NaN are false, so `max` could ignore NaN.
    return math.inf if math.isnan(difference) else difference


def _compute_extent(scene: Scene) -> float:
    return max(abs(c) + disc.radius_m for disc in scene.discs for c in disc.position_m)


def compute_deepest_overlap(trace: Trace, scene: Scene) -> float:
    """Return the deepest overlap of two bodies at the end of a run, in metres; infinite if a position is NaN."""
    position = np.asarray(trace.final_position_m, dtype=np.float64)
    if not np.all(np.isfinite(position)):
        return math.inf
    radius, movable = scene.arrays.radius_m, scene.arrays.movable
    deepest = 0.0
    for i in range(len(radius) - 1):
        rest = slice(i + 1, None)
        distance = np.hypot(*(position[rest] - position[i]).T)
        overlap = np.where(movable[i] | movable[rest], radius[i] + radius[rest] - distance, 0.0)
        deepest = max(deepest, float(np.max(overlap)))
    at_end_s = trace.end_time_s
    for wall in (move_wall(w, *w.drive.moved_at(at_end_s)) if w.driven else w for w in scene.walls):
        if isinstance(wall, Wall):
            reach = radius - (position - wall.point_m) @ np.array(wall.normal)
        else:
            gap = [
                wall.outline.compute_gap(x, y, r) for (x, y), r in zip(position.tolist(), radius.tolist(), strict=True)
            ]
            reach = -np.array(gap)
        deepest = max(deepest, float(np.max(np.where(movable, reach, 0.0))))
    return deepest
