"""Checks that the sizes in a scene don't differ too much for floats, and counts the steps of a duration.

Every length in a scene, and the longest possible path of a disc, is compared with the smallest radius. Every mass is
compared with the smallest mass. See `carom.support.limits`.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from carom.errors import InputError, Problem
from carom.model.chain_geometry import Outline
from carom.model.disc_arrays import DiscArrays, list_wall_lengths
from carom.support.formatting import format_metres, format_number
from carom.support.limits import MOST_STEPS, SPAN

Vector = tuple[float, float]

_LEAST = format_number(1.0 / SPAN)


class Sizes(NamedTuple):
    """Smallest and largest sizes in a scene, in SI units.

    Attributes:
        length: Greatest coordinate or radius of any disc or wall.
        radius: Smallest radius of a disc.
        speed: The greatest of: initial and prescribed velocity components, rim speeds (spin times radius), and the
            speed that gravity gives a disc from rest within the duration.
        duration: Duration of the scene.
        lightest: Smallest mass of a movable disc; 1 if there is none.
        heaviest: Greatest mass of a movable disc; 1 if there is none.
    """

    length: float
    radius: float
    speed: float
    duration: float
    lightest: float
    heaviest: float

    @classmethod
    def of(cls, start: DiscArrays, gravity_m_s2: Vector, duration_s: float) -> Sizes:
        """Return the sizes of a scene with the starting state `start`."""
        points = [abs(length) for wall in start.walls for length in list_wall_lengths(wall)]
        masses = start.mass_kg[start.movable]
        return cls(
            max(float(np.abs(start.position_m).max()), float(start.radius_m.max()), *points),
            float(start.radius_m.min()),
            max(
                float(np.abs(start.velocity_m_s).max()),
                float(np.abs(start.driven_speeds).max(initial=0.0)),
                float(np.abs(start.surface_speed_m_s).max()),
                *(abs(g) * duration_s for g in gravity_m_s2),
            ),
            duration_s,
            float(masses.min()) if len(masses) else 1.0,
            float(masses.max()) if len(masses) else 1.0,
        )

    @property
    def way(self) -> float:
        """Distance that a disc with the greatest speed covers in the scene's duration."""
        return self.speed * self.duration


def find_span_problems(start: DiscArrays, gravity_m_s2: Vector, duration_s: float) -> Iterator[Problem]:
    """Yield a problem for each pair of sizes whose ratio is too large."""
    sizes = Sizes.of(start, gravity_m_s2, duration_s)
    if sizes.length > SPAN * sizes.radius:
        yield Problem(
            ("discs", int(start.radius_m.argmin()), "radius_m"),
            f"must be at least {_LEAST} of the greatest length in the scene, {format_metres(sizes.length)}, "
            f"got {sizes.radius}; remove bodies that are so small, or so far away",
        )
    for index, wall in enumerate(start.walls):
        if isinstance(wall, Outline):
            yield from _find_short_edges(index, wall, sizes.length)
    if sizes.heaviest > SPAN * sizes.lightest:
        yield Problem(
            ("discs", int(start.mass_kg.argmin()), "mass_kg"),
            f"must be at least {_LEAST} of the greatest finite mass in the scene, {format_number(sizes.heaviest, 3)} "
            f"kg, got {sizes.lightest}; make the heavy discs immovable (mass_kg = inf)",
        )
    if sizes.speed > 0.0 and SPAN * sizes.way < sizes.length:
        yield Problem(
            ("duration_s",),
            f"must be so long that the fastest disc moves by {_LEAST} of the greatest length in the scene, "
            f"{format_metres(sizes.length)}, got {sizes.duration}: it moves by {format_metres(sizes.way)}; use a "
            "longer duration",
        )
    if not sizes.way <= SPAN * sizes.radius:
        yield Problem(
            ("duration_s",),
            f"must be so short that no disc flies further than {format_number(SPAN, 3)} times the smallest radius, "
            f"got {sizes.duration}: the path is {format_metres(sizes.way)} long; use a shorter duration",
        )


def _find_short_edges(index: int, wall: Outline, greatest: float) -> Iterator[Problem]:
    for edge, (a, b, _) in enumerate(wall.edges):
        if greatest > SPAN * (length := math.dist(a, b)):
            yield Problem(
                ("walls", index, "points_m", (edge + 1) % len(wall.points)),
                f"makes edge {edge} only {format_metres(length)} long; edges must be at least {_LEAST} of the greatest "
                f"length in the scene, {format_metres(greatest)}; remove the point",
            )


def count_steps(duration_s: float, dt_s: float) -> int:
    """Return the number of steps of size `dt_s` that cover a duration, 0 or more. The last step may end later.

    If the duration is a whole number of steps, rounding must not add another step. Duration and step size may be
    rounded numbers, such as 1/240, each with a relative error of up to 2^-53. So if duration divided by step size
    exceeds a whole number by no more than these errors, the whole number is returned. The quotient itself is computed
    exactly.

    Raises:
        InputError: `dt_s` is not a finite number above 0, or more than `carom.support.limits.MOST_STEPS` steps are
            needed.
    """
    if not 0 < dt_s < math.inf:
        raise InputError(f"a step size must be a finite number of seconds above 0, got {dt_s}")
    (a, b), (c, d) = duration_s.as_integer_ratio(), dt_s.as_integer_ratio()
    numerator, denominator = a * d, b * c  # the quotient is numerator / denominator
    if numerator > MOST_STEPS * denominator:
        raise InputError(
            f"a step size must be at least {format_number(1 / MOST_STEPS, 3)} of the scene's duration ({duration_s} "
            f"s), got {dt_s}: lengthen it, or shorten the scene"
        )
    nearest = (2 * numerator + denominator) // (2 * denominator)
    if nearest > 0 and abs(numerator - nearest * denominator) * 2**52 <= numerator:
        return nearest
    return -(-numerator // denominator)
