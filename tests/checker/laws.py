"""Whether velocities and spins after an impact are those that the laws of restitution and friction give.

The law, applied to the recorded normal, is off by 24 roundings in either's relative velocity along it (4 in the sum of
products, 10 from the normal twice, the rest in masses and factors), and one in the sum. What friction gives (`rough`)
is right to as many roundings of its own.

A disc that falls back to its wall comes with the speed that it left with, from which the recorded velocity differs by
no more than the error of its flight.

By the TC model an impact within the contact duration of the last one of either disc that moves is elastic, without
friction. Both times are recorded with an error of 2 u T, so where they are as far apart as the contact duration, to
within 4 u T and the rounding of their difference, either law may hold.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from tests.checker.flights import UNIT, Flights
from tests.checker.report import Report, Violation, find_violations
from tests.checker.rough import Rub, compute_friction
from tests.checker.watch import Stretch

from carom import DiscArrays

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]

#: Smallest float above 0: what an underflow may cost.
SMALLEST = float(np.finfo(float).smallest_subnormal)


@dataclass(frozen=True)
class Elastic:
    """Which impacts the TC model makes elastic, shape ``(k,)`` each: those that are, and those that may be."""

    surely: Bools
    maybe: Bools


def find_elastic_impacts(start: DiscArrays, stretch: Stretch, contact_duration_s: float) -> Elastic:
    """Return which impacts follow the last one of a disc by less than the contact duration."""
    rows = stretch.impacts
    time = rows["time_s"]
    since = time[:, None] - _last_s(start, stretch)
    known = UNIT * (4 * time[:, None] + since)
    known[np.isinf(since)] = 0.0
    short = contact_duration_s - since
    surely, maybe = short > known, short >= -known
    if contact_duration_s == 0.0:
        maybe[:] = False
    return Elastic(surely[:, 0] | surely[:, 1], maybe[:, 0] | maybe[:, 1])


def _last_s(start: DiscArrays, stretch: Stretch) -> Floats:
    """Return when either disc had its last impact before each one, shape ``(k, 2)``; -inf for none, or no movable."""
    bodies = np.stack([stretch.impacts["first"], stretch.impacts["second"]], axis=1).ravel()
    movable = np.append(start.movable, False)[np.maximum(bodies, -1)]  # a wall, at -1, is not
    order = np.flatnonzero(movable)
    order = order[np.argsort(bodies[order], kind="stable")]  # each disc's impacts, one after another
    disc, time = bodies[order], np.repeat(stretch.impacts["time_s"], 2)[order]
    last = np.roll(time, 1)
    begins = np.diff(disc, prepend=-1) != 0
    last[begins] = stretch.last_impact_s[disc[begins]]
    last_s = np.full(len(bodies), -np.inf)
    last_s[order] = last
    return last_s.reshape(-1, 2)


def find_law_violations(
    start: DiscArrays, stretch: Stretch, flights: Flights, contact_duration_s: float, report: Report
) -> list[Violation]:
    """Return the impacts after which a velocity or a spin is not what the law gives, to rounding."""
    elastic = find_elastic_impacts(start, stretch, contact_duration_s)
    report.elastic += int(elastic.surely.sum())
    found = _broken(start, stretch, flights, elastic.surely)
    either = elastic.maybe & ~elastic.surely
    if found and either.any():
        otherwise = {violation.row for violation in _broken(start, stretch, flights, elastic.maybe)}
        fits = {stretch.first_row + k for k in np.flatnonzero(either).tolist()} - otherwise
        found = [violation for violation in found if violation.row not in fits]
    return found


def _broken(start: DiscArrays, stretch: Stretch, flights: Flights, elastic: Bools) -> list[Violation]:
    rows = stretch.impacts
    first, second = rows["first"], rows["second"]
    hit = second >= 0
    v1, v2 = rows["velocity_first_before"], rows["velocity_second_before"]
    ux, uy = (v2 - v1).T
    nx, ny = rows["normal"].T
    speed = np.hypot(ux, uy)
    w1 = 1.0 / start.mass_kg[first]
    w2 = np.where(hit, 1.0 / start.mass_kg[np.where(hit, second, 0)], 0.0)
    restitution = np.where(elastic, 1.0, np.where(hit, start.restitution, start.wall_restitution))
    along = np.minimum(ux * nx + uy * ny, 0.0)
    ended = flights.after[:, 0] - 1
    fell = flights.velocity_error(np.where(ended >= 0, ended, 0)) * ~hit
    rims, rub = _rims(start, stretch, "before"), Rub(np.zeros(len(rows)), np.zeros(len(rows)))
    if rims is not None:
        rub = compute_friction(start, rows, rims, fell)
        rub = Rub(np.where(elastic, 0.0, rub.impulse), np.where(elastic, 0.0, rub.bound))
    found = []
    for side, (name, before, share, light) in enumerate(
        (("first", v1, w1 / (w1 + w2), w1), ("second", v2, -w2 / (w1 + w2), w2))
    ):
        push = (1.0 + restitution) * share * along
        drag = (-1.0, 1.0)[side] * light * rub.impulse
        after = rows[f"velocity_{name}_after"]
        off = np.hypot(
            after[:, 0] - (before[:, 0] + push * nx - drag * ny), after[:, 1] - (before[:, 1] + push * ny + drag * nx)
        )
        bound = UNIT * (24 * (1.0 + restitution) * np.abs(share) * speed + 4 * np.hypot(*before.T)) + 16 * SMALLEST
        bound += (1.0 + restitution) * np.abs(share) * fell
        rubbed = light * (rub.bound + 24 * UNIT * np.abs(rub.impulse) + 16 * SMALLEST)
        found += find_violations("law", stretch, off, bound + rubbed)
        if rims is None:
            continue
        turns = 1.0 / start.inertia[np.where(rows[name] >= 0, rows[name], 0)]
        turned = _rims(start, stretch, "after")
        assert turned is not None
        off = np.abs(turned[side] - (rims[side] - turns * light * rub.impulse))
        found += find_violations("law", stretch, off, turns * rubbed + 8 * UNIT * np.abs(rims[side]) + 16 * SMALLEST)
    return found


def _rims(start: DiscArrays, stretch: Stretch, when: str) -> tuple[Floats, Floats] | None:
    """Return how fast the rims of both bodies are, in metres per second, 0 of a wall; None where nothing turns."""
    if stretch.spins is None:
        return None
    radius = np.append(start.radius_m, 0.0)
    one, two = (radius[np.maximum(stretch.impacts[n], -1)] * stretch.spins[f"{n}_{when}"] for n in ("first", "second"))
    return one, two
