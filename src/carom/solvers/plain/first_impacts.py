"""First impacts of many scenes of two discs and no wall, on plain floats: what runs without the compiled extension.

Operation by operation what `carom.solvers.first_impacts` does; a test holds the two to the same bits.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from carom.extension import Patience
from carom.physics.impact_law import pair_push
from carom.physics.pair_time import pair_time

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    Array = NDArray[np.float64]

__all__ = ["fill_first_impacts"]


class _Disc(NamedTuple):
    """A disc at an instant; the inverse mass is 0 for one that never moves."""

    x: float
    y: float
    vx: float
    vy: float
    radius: float
    inverse_mass: float


class _Impact(NamedTuple):
    """An impact: seconds, and the two discs in contact, before it."""

    time: float
    first: _Disc
    second: _Disc


def fill_first_impacts(
    first: Sequence[Array],
    second: Sequence[Array],
    restitution: float,
    until: float,
    frames: Array | None,
    impacts: Sequence[Array],
) -> None:
    """Write the first impact of each scene; arguments as in `carom.solvers.first_impacts.fill_first_impacts`."""
    time, normal, after_first, after_second = impacts
    instants = None if frames is None else frames.tolist()
    patience = Patience()
    for k, (one, other) in enumerate(zip(_discs(first), _discs(second), strict=True)):
        impact = _pic(one, other, until) if instants is None else _pit(one, other, instants)
        if impact is None:
            time[k], normal[k] = math.inf, math.nan
            after_first[k], after_second[k] = (one.vx, one.vy), (other.vx, other.vy)
        else:
            time[k], a, b = impact
            dx, dy = b.x - a.x, b.y - a.y
            push = pair_push(dx, dy, b.vx - a.vx, b.vy - a.vy, a.inverse_mass + b.inverse_mass, restitution)
            distance = math.sqrt(dx * dx + dy * dy)
            normal[k] = dx / distance, dy / distance
            after_first[k] = a.vx + push * a.inverse_mass * dx, a.vy + push * a.inverse_mass * dy
            after_second[k] = b.vx - push * b.inverse_mass * dx, b.vy - push * b.inverse_mass * dy
        patience.look()


def _discs(arrays: Sequence[Array]) -> list[_Disc]:
    position, velocity, radius, mass = arrays
    return [_Disc(*row) for row in np.column_stack((position, velocity, radius, 1.0 / mass)).tolist()]


def _moved(disc: _Disc, wait: float) -> _Disc:
    if disc.inverse_mass == 0.0:
        return disc
    return disc._replace(x=disc.x + disc.vx * wait, y=disc.y + disc.vy * wait)


def _pic(a: _Disc, b: _Disc, until: float) -> _Impact | None:
    time = pair_time(*a[:5], *b[:5])
    if not time <= until or time == math.inf:
        return None
    return _Impact(time, _moved(a, time), _moved(b, time))


def _pit(a: _Disc, b: _Disc, instants: list[float]) -> _Impact | None:
    ux, uy, contact = b.vx - a.vx, b.vy - a.vy, a.radius + b.radius
    before = instants[0] if instants else 0.0
    for instant in instants:
        if instant != before:
            a, b, before = _moved(a, instant - before), _moved(b, instant - before), instant
        dx, dy = b.x - a.x, b.y - a.y
        along, squared = dx * ux + dy * uy, dx * dx + dy * dy
        if along < 0.0 and math.sqrt(squared) <= contact:
            return _Impact(instant, a, b)
        # See the compiled form.
        if along > 2.0**-20 * math.sqrt(squared) * math.sqrt(ux * ux + uy * uy):
            return None
    return None
