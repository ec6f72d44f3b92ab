"""Accuracy and cost of the time of impact, compared with textbook formulas: ``python -m benchmarks.time_of_impact``."""

from __future__ import annotations

import math
import statistics
import time
from typing import TYPE_CHECKING, Any

import numpy as np
from benchmarks.arguments import parser, run

from carom.core.time_of_impact import time_of_impact
from carom.errors import MissingExtraError

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    Array = NDArray[np.float64]

#: Kinds of input for which formulas differ; see ``docs/theory/pic.md``.
CLASSES = (
    "random",
    "grazing 1e-14..1e-4",
    "grazing 1e-15",
    "offset by 1e8",
    "far apart",
    "slow",
    "tiny",
    "near contact",
    "near and grazing",
    "far and grazing",
    "far and grazing along an axis",
    "as they come",
)


def pairs_of_class(name: str, count: int, seed: int = 1) -> Array:
    """Return ten columns of `count` pairs of discs, in the order of `carom.core.primitives.pair_time`'s arguments.

    Pairs of the last class, "as they come", are random, and a tenth of them hit. In the other classes, all pairs
    approach, and hit or graze.
    """
    rng = np.random.default_rng(seed)
    if name == "as they come":
        place, speed = rng.uniform(-5, 5, (2, 2, count)), rng.normal(size=(2, 2, count))
        radius = rng.uniform(0.1, 1.0, (2, count))
        return np.array([*place[0], *speed[0], radius[0], *place[1], *speed[1], radius[1]])
    radius = rng.uniform(0.1, 1.0, (2, count)) * (1e-9 if name == "tiny" else 1.0)
    reach = radius.sum(axis=0)
    miss = rng.uniform(-1.0, 1.0, count) * reach
    distance = np.hypot(miss, reach) * rng.uniform(1.0, 10.0, count)
    pace = rng.uniform(0.1, 2.0, count) * (1e-9 if name == "slow" else 1.0)
    if name == "grazing 1e-14..1e-4":
        miss = reach * (1 - 10 ** rng.uniform(-14, -4, count))
    if name == "grazing 1e-15":
        miss = reach * (1 + rng.uniform(-8e-15, 8e-15, count))
    if name == "far apart":
        distance = reach * 10 ** rng.uniform(1, 8, count)
    if name == "tiny":
        distance = distance * 1e9
    if name == "near contact":
        distance = reach * (1 + 10 ** rng.uniform(-16, -6, count))
    if name == "near and grazing":
        miss = reach * (1 - 10 ** rng.uniform(-15, -4, count))
        distance = reach * (1 + 10 ** rng.uniform(-16, -8, count))
    if name.startswith("far and grazing"):
        miss = reach * (1 + rng.integers(-4, 5, count) * 2.0**-52)
        distance = reach * 10 ** rng.uniform(6, 10, count)
    along = np.sqrt(np.maximum(distance**2 - miss**2, 0.0))
    turn = rng.integers(4, size=count) * math.pi / 2 if name.endswith("axis") else rng.uniform(0, 2 * math.pi, count)
    ahead, aside = np.stack([np.cos(turn), np.sin(turn)]), np.stack([-np.sin(turn), np.cos(turn)])
    origin = rng.uniform(-1e8, 1e8, (2, count)) if name == "offset by 1e8" else np.zeros((2, count))
    velocity = rng.normal(size=(2, count)) * pace
    if name.endswith("axis"):
        ahead, aside, velocity = np.round(ahead), np.round(aside), np.zeros((2, count))
    return np.array(
        [*origin, *velocity, radius[0], *(origin - ahead * along + aside * miss), *(velocity + ahead * pace), radius[1]]
    )


def textbook(columns: Array) -> Array:
    """Return the root by ``(-b - sqrt(b^2 - a c)) / a`` if the discs approach; otherwise infinity."""
    x1, y1, vx1, vy1, r1, x2, y2, vx2, vy2, r2 = columns
    dx, dy, ux, uy, reach = x2 - x1, y2 - y1, vx2 - vx1, vy2 - vy1, r1 + r2
    a, b, c = ux * ux + uy * uy, dx * ux + dy * uy, dx * dx + dy * dy - reach * reach
    d = b * b - a * c
    return np.where((b < 0) & (d > 0), (-b - np.sqrt(d)) / a, math.inf)


def stable(columns: Array) -> Array:
    """Return the root by ``c / (-b + sqrt(a R^2 - (d x u)^2))``, the best simple form, if the discs approach."""
    x1, y1, vx1, vy1, r1, x2, y2, vx2, vy2, r2 = columns
    dx, dy, ux, uy, reach = x2 - x1, y2 - y1, vx2 - vx1, vy2 - vy1, r1 + r2
    b, c, cross = dx * ux + dy * uy, dx * dx + dy * dy - reach * reach, dx * uy - dy * ux
    d = (ux * ux + uy * uy) * (reach * reach) - cross * cross
    return np.where((b < 0) & (d > 0), c / (np.sqrt(d) - b), math.inf)


def carom_form(columns: Array) -> Array:
    """Return the result of `carom.time_of_impact`, which also checks its input."""
    c = columns
    return np.asarray(time_of_impact(c[0:2].T, c[2:4].T, c[4], c[5:7].T, c[7:9].T, c[9]))


def _errors(columns: Array, times: Array) -> tuple[float, float, int]:
    """Return the median and largest error in units of the last place, and the number of wrong hits or misses."""
    try:
        from flint import arb, ctx
    except ImportError:
        raise MissingExtraError("the exact answers need python-flint: pip install 'carom[certify]'") from None
    ctx.prec = 600  # the exact answer needs about 430 bits
    errors, wrong = [], 0
    for row, found in zip(columns.T.tolist(), times.tolist(), strict=True):
        exact = _exact(*(arb(value) for value in row))
        if exact is None or not math.isfinite(found):
            wrong += (exact is None) != math.isinf(found)
        elif exact > 0:
            errors.append(float(abs(arb(found) - exact)) / math.ulp(float(exact.mid())))
    return float(np.median(errors)), max(errors), wrong


def _exact(x1: Any, y1: Any, vx1: Any, vy1: Any, r1: Any, x2: Any, y2: Any, vx2: Any, vy2: Any, r2: Any) -> Any:
    dx, dy, ux, uy, reach = x2 - x1, y2 - y1, vx2 - vx1, vy2 - vy1, r1 + r2
    a, b, c = ux * ux + uy * uy, dx * ux + dy * uy, dx * dx + dy * dy - reach * reach
    d = b * b - a * c
    if not (b < 0 and d > 0):
        return None
    return c / (d.sqrt() - b) if c > 0 else c * 0


def _nanoseconds(form: Callable[[Array], Array], columns: Array, repeats: int = 15) -> float:
    """Return the median time per pair of discs, in nanoseconds."""
    times: list[float] = []
    for _ in range(repeats):
        begin = time.thread_time()
        form(columns)
        times.append(time.thread_time() - begin)
    return statistics.median(times) / len(columns[0]) * 1e9


def main(count: int = 20_000, checked: int = 10_000) -> None:
    """Print the table.

    The cost is measured for `count` pairs in one call, and errors are computed for the first `checked` pairs.
    """
    forms = {"textbook": textbook, "stable": stable, "carom": carom_form}
    print("cost: processor time, median")
    print(f"{'class':30}" + "".join(f"{name + ': ulp median / largest, wrong, ns':>52}" for name in forms))
    for name in CLASSES:
        columns = np.ascontiguousarray(pairs_of_class(name, count))
        line = f"{name:30}"
        for form in forms.values():
            with np.errstate(all="ignore"):
                median, largest, wrong = _errors(columns[:, :checked], form(columns[:, :checked]))
                line += f"{median:22.2g} /{largest:9.2g}{wrong:8d}{_nanoseconds(form, columns):11.1f}"
        print(line)


if __name__ == "__main__":
    run(parser("benchmarks.time_of_impact", __doc__), main)
