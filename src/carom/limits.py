"""The sizes of numbers that Carom computes with. They are stated here, and every way in keeps them.

- No number that measures something is larger than `LARGEST` in magnitude, so that its square is a float; and a radius,
  mass, duration or rate is not smaller than `SMALLEST`.
- Sizes from ``1 / ORDINARY`` to `ORDINARY` are computed with as they are: the formulas are of fourth degree at most, so
  their terms, and what the rounding of these leaves, stay within the range of floats.
- What belongs to one scene spans no more than `ORDINARY`, so that there are units in which it is ordinary: its lengths,
  the way that a disc can fly until the end among them, against the smallest radius; and its masses.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from carom.errors import InputError, Problem

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import NDArray

    from carom.scene import Scene

    Array = NDArray[np.float64]

__all__ = ["LARGEST", "MOST_STEPS", "ORDINARY", "SMALLEST", "Sizes", "beyond", "require_within", "span_problems"]

LARGEST = 2.0**511
SMALLEST = 1.0 / LARGEST
ORDINARY = 2.0**200

#: Steps or frames of a run. Who asks for more has mistaken a unit.
MOST_STEPS = 2**32


def beyond(least: float, most: float) -> str:
    """Return what to say of a number that is not between two limits."""
    span = f"lie between {least:.3g} and {most:.3g}" if least > 0.0 else f"be at most {most:.3g} in magnitude"
    return f"must {span} (measure in other units)"


def require_within(name: str, array: Array, least: float, most: float) -> None:
    """Refuse an argument that is not finite, or not between two limits in magnitude, everywhere.

    Raises:
        InputError: The message names the argument, the first such value, and the limits.
    """
    size = np.abs(array)
    wrong = ~((size <= most) & (size >= least))
    if wrong.any():
        value = array[wrong].flat[0]
        raise InputError(f"{name} {beyond(least, most) if np.isfinite(value) else 'must be finite'}, got {value}")


class Sizes(NamedTuple):
    """How large what belongs to one scene is; SI units.

    Attributes:
        length: Greatest coordinate (of a disc or wall) or radius.
        radius: Smallest radius.
        speed: Greatest velocity component at the start or, if that is more, what gravity makes of rest until the end.
        duration: How long the scene is simulated.
        lightest: Least mass of a movable disc; 1 where there is none.
        heaviest: Greatest mass of a movable disc; 1 where there is none.
    """

    length: float
    radius: float
    speed: float
    duration: float
    lightest: float
    heaviest: float

    @classmethod
    def of(cls, scene: Scene) -> Sizes:
        """Return the sizes of a scene."""
        places = [abs(c) for body in scene.discs for c in body.position_m]
        points = [abs(c) for wall in scene.walls for c in wall.point_m]
        radii = [disc.radius_m for disc in scene.discs]
        speeds = [abs(c) for disc in scene.discs for c in disc.velocity_m_s]
        pull = max(map(abs, scene.gravity_m_s2))
        masses = [disc.mass_kg for disc in scene.discs if disc.mass_kg < math.inf] or [1.0]
        return cls(
            max(*places, *points, *radii),
            min(radii),
            max(*speeds, pull * scene.duration_s),
            scene.duration_s,
            min(masses),
            max(masses),
        )

    @property
    def way(self) -> float:
        """How far the greatest speed leads until the end."""
        return self.speed * self.duration


def span_problems(scene: Scene) -> Iterator[Problem]:
    """Yield what in a scene spans more than there are units for."""
    sizes = Sizes.of(scene)
    least = f"{1.0 / ORDINARY:.3g}"
    if sizes.length > ORDINARY * sizes.radius:
        disc = next(i for i, disc in enumerate(scene.discs) if disc.radius_m == sizes.radius)
        yield Problem(
            ("discs", disc, "radius_m"),
            f"must be at least {least} of the greatest length in the scene, {sizes.length:.3g} m, "
            f"got {sizes.radius}; leave out what is so small, or so far away",
        )
    if sizes.heaviest > ORDINARY * sizes.lightest:
        disc = next(i for i, disc in enumerate(scene.discs) if disc.mass_kg == sizes.lightest)
        yield Problem(
            ("discs", disc, "mass_kg"),
            f"must be at least {least} of the greatest finite mass in the scene, {sizes.heaviest:.3g} kg, "
            f"got {sizes.lightest}; make the heavy discs immovable (mass_kg = inf)",
        )
    if sizes.speed > 0.0 and sizes.way < SMALLEST * sizes.length:
        yield Problem(
            ("duration_s",),
            f"must be so long that the fastest disc moves by {SMALLEST:.3g} of the greatest length in the scene, "
            f"{sizes.length:.3g} m, got {sizes.duration}: it moves by {sizes.way:.3g} m; lengthen it",
        )
    if not sizes.way <= ORDINARY * sizes.radius:
        yield Problem(
            ("duration_s",),
            f"must be so short that no disc flies further than {ORDINARY:.3g} times the smallest radius, "
            f"got {sizes.duration}: the way is {sizes.way:.3g} m; shorten it",
        )
