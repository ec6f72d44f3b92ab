"""Optional helpers that adapters of several engines share."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from carom.engines.api.declarations import Profile
from carom.engines.api.interfaces import Contact
from carom.model.scene import Disc, Scene

Vector = tuple[float, float]

#: A coefficient whose square underflows to 0 in 64-bit floats. The coefficient is a power of two, so multiplication and
#: division by it are exact.
VANISHING = 2.0**-600

#: Number of impacts on driven bodies, such as paddles, that `reach` takes into account. Each of these impacts can make
#: a disc faster.
DRIVEN_IMPACTS = 32


class AliasedProfiles(dict[str, Profile]):
    """Profiles by name. A lookup also accepts an alias of a profile. Iteration yields names, but no aliases.

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
    """Computes the time of a world from the number of its steps. All steps are equal until `cut` sets another size.

    Attributes:
        dt_s: Size of the following steps, in seconds.
    """

    def __init__(self, dt_s: float) -> None:
        self.dt_s = dt_s
        self._start_s, self._steps = 0.0, 0

    def count(self, steps: int) -> None:
        """Add completed steps to the count."""
        self._steps += steps

    @property
    def now_s(self) -> float:
        """Present time, in seconds from the start of the run."""
        return self._start_s + self._steps * self.dt_s

    @property
    def step_began_s(self) -> float:
        """Time at the start of the last step, in seconds from the start of the run."""
        return self._start_s + (self._steps - 1) * self.dt_s

    def cut(self, dt_s: float) -> None:
        """Set the size of the following steps."""
        self.restart(self.now_s)
        self.dt_s = dt_s

    def restart(self, time_s: float) -> None:
        """Continue at a time, in seconds from the start of the run."""
        self._start_s, self._steps = time_s, 0


def factored_restitutions(scene: Scene) -> tuple[float, float]:
    """Return restitutions of a disc and of a wall, for an engine that multiplies the restitutions of two bodies."""
    return _factor(scene.restitution, scene.wall_restitution)


def factored_frictions(scene: Scene) -> tuple[float, float]:
    """Return frictions of a disc and of a wall, for an engine that multiplies the frictions of two bodies."""
    return _factor(scene.friction, scene.wall_friction)


def _factor(pair: float, wall: float) -> tuple[float, float]:
    """Return coefficients of discs and of walls for an engine that multiplies the coefficients of two bodies.

    `pair` is the coefficient of two discs, and `wall` is the coefficient of a disc and a wall. A disc gets the square
    root of `pair`. If `pair` is 0, a disc gets a tiny coefficient, and a wall gets a large coefficient. The square of
    the tiny coefficient underflows to 0, but its product with the wall's coefficient does not.
    """
    disc = math.sqrt(pair) if pair > 0 else VANISHING
    return disc, wall / disc


def reach(scene: Scene, dt_s: float) -> tuple[Vector, float]:
    """Return the middle of a scene, and the largest distance from it that any disc can reach, in metres.

    The distance is an upper bound, measured to the farthest point of a disc. In engines without half-planes, walls must
    extend to this distance. The bound follows from the scene's energy, including the energy of spins and of falling.
    Only impacts on driven bodies add energy. The bound allows for `DRIVEN_IMPACTS` impacts on driven bodies, each of
    which can add twice the speed of the driven body.
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
    # A falling disc gains energy, and an impact can pass this energy on to a lighter disc.
    gained_m_s = math.hypot(*scene.gravity_m_s2) * duration_s * math.sqrt(sum(d.mass_kg / lightest for d in movable))
    return centre, start + (fastest + gained_m_s) * duration_s


def is_fast(disc: Disc, dt_s: float) -> bool:
    """Whether a disc moves by more than its radius in a step, so that it needs continuous detection."""
    return disc.drive.fastest * dt_s > disc.radius_m


def pair_of(a: int, b: int) -> tuple[int, int]:
    """Return two bodies in the order of `Contact`: the disc with the lower number is first, and a wall is second."""
    low, high = (a, b) if a < b else (b, a)
    return (high, low) if low < 0 else (low, high)


def flattened(normal: Vector, impulse_n_s: float) -> tuple[Vector, float]:
    """Project an impulse in space onto the plane. Return the unit normal and the size of the projected impulse.

    In three-dimensional engines, bodies can lean out of the plane. `normal` consists of the x and y components of a
    unit vector in space. For an impulse perpendicular to the plane, `normal` is (0, 0), and the returned size is 0.
    """
    length = math.hypot(*normal)
    if length == 0.0:
        return (1.0, 0.0), 0.0
    return (normal[0] / length, normal[1] / length), impulse_n_s * length


def oriented_contact(
    a: int, b: int, time_s: float, normal: Vector, impulse_n_s: float, tangential_impulse_n_s: float | None = None
) -> Contact:
    """Return the contact of two bodies, given in any order. `normal` points from `a` to `b`.

    The tangential impulse acts on `b`. If the bodies are exchanged, the normal, the tangent and the impulse are all
    reversed, so `tangential_impulse_n_s` keeps its sign.
    """
    first, second = pair_of(a, b)
    nx, ny = normal
    oriented = (nx, ny) if first == a else (-nx, -ny)
    return Contact(first, second, time_s, oriented, impulse_n_s, tangential_impulse_n_s=tangential_impulse_n_s)
