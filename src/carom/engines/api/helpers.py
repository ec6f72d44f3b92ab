"""Helpers shared by adapters of several engines. No adapter has to use them."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from carom.engines.api.declarations import Profile
from carom.engines.api.protocol import Contact
from carom.model.scene import Disc, Scene

Vector = tuple[float, float]

#: A coefficient whose square is 0 in 64-bit floats, in which the least positive number is 2**-1074. The coefficient is
#: a power of two, so multiplying and dividing by it is exact.
VANISHING = 2.0**-600

#: Long walls replace half-planes. The walls are long enough for this number of impacts on driven bodies. A paddle or a
#: piston has few such impacts; for a disc that is crushed, no number is enough.
DRIVEN_IMPACTS = 32


class AliasedProfiles(dict[str, Profile]):
    """Profiles by name, some with aliases. Lookups accept aliases; listings leave them out.

    Args:
        profiles: The profiles by name.
        aliases: Names of profiles by alias.
    """

    def __init__(self, profiles: Mapping[str, Profile], aliases: Mapping[str, str]) -> None:
        super().__init__(profiles)
        self._aliases = aliases

    def __missing__(self, name: str) -> Profile:
        return self[self._aliases[name]]

    def __contains__(self, name: object) -> bool:
        return super().__contains__(self._aliases.get(str(name), name))

    def get(self, name: str, default: Any = None) -> Any:
        """Return a profile by its name or by an alias."""
        return super().get(self._aliases.get(name, name), default)


class StepClock:
    """Time of a world, from the number of its steps. Steps have equal length until they are cut.

    Attributes:
        dt_s: Size of the following steps, seconds.
    """

    def __init__(self, dt_s: float) -> None:
        self.dt_s = dt_s
        self._start_s, self._steps = 0.0, 0

    def count(self, steps: int) -> None:
        """Add steps that were taken."""
        self._steps += steps

    @property
    def now_s(self) -> float:
        """Seconds from the start."""
        return self._start_s + self._steps * self.dt_s

    @property
    def step_began_s(self) -> float:
        """Start of the last step, seconds from the start."""
        return self._start_s + (self._steps - 1) * self.dt_s

    def cut(self, dt_s: float) -> None:
        """Set the size of the following steps."""
        self.restart(self.now_s)
        self.dt_s = dt_s

    def restart(self, time_s: float) -> None:
        """Continue from a time, seconds from the start."""
        self._start_s, self._steps = time_s, 0


def factored_restitutions(scene: Scene) -> tuple[float, float]:
    """Return restitutions (of every disc, of every wall) whose products are the coefficients of a scene."""
    return _factor(scene.restitution, scene.wall_restitution)


def factored_frictions(scene: Scene) -> tuple[float, float]:
    """Return coefficients of friction (of every disc, of every wall) whose products are the coefficients of a scene."""
    return _factor(scene.friction, scene.wall_friction)


def _factor(pair: float, wall: float) -> tuple[float, float]:
    """Return coefficients of discs and of walls for an engine that multiplies the coefficients of two bodies.

    The coefficient of a disc is the root of the coefficient of two discs. If the pair has the coefficient 0 and the
    walls have more, the disc gets a tiny coefficient and the walls get a huge coefficient. The square of the tiny
    coefficient underflows to 0, but its product with the huge coefficient does not.
    """
    disc = math.sqrt(pair) if pair > 0 else VANISHING
    return disc, wall / disc


def reach(scene: Scene, dt_s: float) -> tuple[Vector, float]:
    """Return the middle of a scene, and the largest distance from the middle that a point of a disc can reach, metres.

    Engines without half-planes choose the size of their walls by this distance. No impact adds energy. So the speed of
    a disc is limited by the total energy of the scene, which includes the energy of spins and of falling. A driven body
    adds up to twice its speed at each impact. `DRIVEN_IMPACTS` such impacts are included.
    """
    x, y = zip(*(disc.position_m for disc in scene.discs), strict=True)
    centre = (min(x) / 2 + max(x) / 2, min(y) / 2 + max(y) / 2)
    start = max(math.dist(disc.position_m, centre) + disc.radius_m for disc in scene.discs)
    movable = [disc for disc in scene.discs if not disc.immovable]
    lightest = min((disc.mass_kg for disc in movable), default=1.0)
    speeds = [math.sqrt(d.mass_kg / lightest) * math.hypot(*d.velocity_m_s) for d in movable]
    rims = [
        math.sqrt(d.inertia_factor * d.mass_kg / lightest) * d.radius_m * d.spin_rad_s for d in movable if d.spin_rad_s
    ]
    fastest = math.hypot(*speeds, *rims)
    driven = [body.drive.fastest for body in (*scene.discs, *scene.walls) if body.driven]
    belts = [abs(wall.surface_speed_m_s) for wall in scene.walls]
    fastest += 2.0 * DRIVEN_IMPACTS * max((*driven, *belts), default=0.0)
    duration_s = scene.duration_s + dt_s
    # A disc gains energy by falling, and an impact can pass this energy on to a lighter disc.
    gained_m_s = math.hypot(*scene.gravity_m_s2) * duration_s * math.sqrt(sum(d.mass_kg / lightest for d in movable))
    return centre, start + (fastest + gained_m_s) * duration_s


def is_fast(disc: Disc, dt_s: float) -> bool:
    """Whether a disc moves by more than its radius in a step, so that it needs continuous detection."""
    return disc.drive.fastest * dt_s > disc.radius_m


def pair_of(a: int, b: int) -> tuple[int, int]:
    """Return two bodies in the order of `Contact`: the lower disc first, a wall second."""
    low, high = (a, b) if a < b else (b, a)
    return (high, low) if low < 0 else (low, high)


def flattened(normal: Vector, impulse_n_s: float) -> tuple[Vector, float]:
    """Project an impulse in space onto the plane. Return its unit normal and its size along the normal.

    Engines need this for bodies that lean out of the plane. `normal` is the first two components of a unit vector. An
    impulse perpendicular to the plane, (0, 0), has size 0.
    """
    length = math.hypot(*normal)
    if length == 0.0:
        return (1.0, 0.0), 0.0
    return (normal[0] / length, normal[1] / length), impulse_n_s * length


def oriented_contact(
    a: int, b: int, time_s: float, normal: Vector, impulse_n_s: float, tangential_impulse_n_s: float | None = None
) -> Contact:
    """Return the contact of two bodies in any order. `normal` is from `a` to `b`; the tangential impulse is on `b`.

    If the bodies are exchanged, normal, tangent and impulse are reversed, and the tangential impulse stays the same.
    """
    first, second = pair_of(a, b)
    nx, ny = normal
    oriented = (nx, ny) if first == a else (-nx, -ny)
    return Contact(first, second, time_s, oriented, impulse_n_s, tangential_impulse_n_s=tangential_impulse_n_s)
