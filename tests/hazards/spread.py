"""Figures over many phases, and the scenes at these phases."""

import statistics
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from carom import Scene, solve_pic
from carom.catalogue.entry import CatalogueScene
from carom.comparator.shifted_scenes import build_shifted_scenes, list_even_phases
from carom.engines.api import Adapter, AdapterError, Observation, Setting

#: A value is wrong if it differs from the value of mechanics by more than this fraction of the speed or energy.
OFF = 0.01


@dataclass(frozen=True)
class Spread:
    """One figure at many phases."""

    values: tuple[float, ...]
    right: float

    @property
    def least(self) -> float:
        """The least."""
        return min(self.values)

    @property
    def most(self) -> float:
        """The greatest."""
        return max(self.values)

    @property
    def median(self) -> float:
        """The median."""
        return statistics.median(self.values)

    @property
    def starts_off(self) -> int:
        """The number of phases at which the value is wrong."""
        return sum(abs(value - self.right) > OFF for value in self.values)

    @property
    def share(self) -> str:
        """The number of phases at which the value is wrong, of all phases."""
        return f"{self.starts_off} of {len(self.values)}"


def build_starts(scene: Scene, count: int) -> list[Scene]:
    """Return a scene at a number of phases, spread evenly over a step of its frame rate."""
    return list(build_shifted_scenes(solve_pic(scene), 1 / scene.frame_rate_hz, list_even_phases(count)))


def run_to_end(adapter: Adapter, scene: Scene, dt_s: float, profile: str, **changes: Setting) -> Observation:
    """Run a scene to its end in one call, and return the observation there."""
    world = adapter.prepare(scene, {**adapter.profiles[profile].settings(dt_s), **changes})
    try:
        world.advance(scene.step_count(dt_s))
        end = world.observe()
    finally:
        world.close()
    if not np.isfinite(end.velocity_m_s).all():
        raise AdapterError(f"{adapter.name}: a velocity at the end is not finite")
    return end


def energy_change(scene: Scene, end: Observation) -> float:
    """Return the relative change of the kinetic energy since the start."""
    masses = np.array([disc.mass_kg for disc in scene.discs])
    start = np.array([disc.velocity_m_s for disc in scene.discs])
    before, after = (float((masses * (v**2).sum(axis=1)).sum()) for v in (start, end.velocity_m_s))
    return after / before - 1


def velocities_after(entry: CatalogueScene) -> NDArray[np.float64]:
    """Return the velocities at the end by a scene's known answer, shape (n, 2)."""
    velocity = np.array([disc.velocity_m_s for disc in entry.scene.discs], dtype=np.float64)
    for impact in entry.known.impacts:
        velocity[impact.first] = impact.velocity_first_after
        if impact.velocity_second_after is not None:
            velocity[impact.second] = impact.velocity_second_after
    return velocity
