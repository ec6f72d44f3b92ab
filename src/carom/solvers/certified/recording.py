"""From balls to float64 numbers with proven radii, and to decimal numbers of proven digits."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from flint import arb, ctx

if TYPE_CHECKING:
    from carom.scene import Scene
    from carom.solvers.certified.bodies import BallBodies, BallImpact

__all__ = ["Recording", "nearest"]

#: Bits kept of a ball beyond the digits asked for.
GUARD_BITS = 64
#: What rounding to a float64 costs, relative to it, and a little more.
ROUNDING = 2.0**-53 * (1.0 + 2.0**-40)
#: Accuracy from which a ball's radius is lost in that little.
NEGLIGIBLE_RADIUS_BITS = 100
#: Decimal digits that every float64 holds.
MOST_FLOAT_DIGITS = 15
LOG2_10 = math.log2(10)


def nearest(ball: arb) -> tuple[float, float]:
    """Return the float64 nearest to a ball's middle, and how far from it the truth can be.

    However `float(ball)` rounds (python-flint 0.9: to the nearest), the float64 that it finds leaves an exact rest of
    at most a unit in its last place, of which 53 bits are added, which is rounded correctly. The radius has 30 bits,
    so it is a float64.
    """
    if ball.is_zero():
        return 0.0, 0.0
    high = float(ball)
    size = abs(high)
    if not 2.0**-900 < size < math.inf:
        return _nearest_out_of_range(ball)
    rest = ball - high
    low = float(rest)
    value = high + low
    if ball.rel_accuracy_bits() >= NEGLIGIBLE_RADIUS_BITS:
        exact = low == 0.0 and rest.is_zero()
        return value, 0.0 if exact else size * ROUNDING
    return value, math.nextafter(float(ball.rad()) + size * ROUNDING, math.inf)


def _nearest_out_of_range(ball: arb) -> tuple[float, float]:
    """Do as `nearest` where float64 has too few bits for the rest, or none at all: scaled by a power of two."""
    mantissa, exponent = ball.mid().man_exp()
    if mantissa == 0:
        return 0.0, math.nextafter(float(ball.rad()), math.inf)
    power = int(exponent) + int(mantissa).bit_length()
    scaled = nearest(ball * arb((1, -power)))
    value, radius = (math.ldexp(number, power) for number in scaled)
    if (math.ldexp(value, -power), math.ldexp(radius, -power)) != scaled:  # each is off by half of the least float
        radius = math.nextafter(radius, math.inf)
    return value, radius


def _quotient(part: arb, length: arb) -> tuple[float, float]:
    """Return a float64 near the quotient of two balls, within 4 roundings of it, and how far the truth can be."""
    if part.is_zero():
        return 0.0, 0.0
    if min(part.rel_accuracy_bits(), length.rel_accuracy_bits()) < NEGLIGIBLE_RADIUS_BITS:
        return nearest(+(part / length))
    divided, divisor = float(part), float(length)
    value = divided / divisor  # each is off by less than two halves of a unit, and divided to a half
    if min(abs(value), abs(divided), divisor) > 2.0**-900:
        return value, abs(value) * 6.0 * ROUNDING
    return nearest(+(part / length))


class Recording:
    """The impacts of a run as float64 numbers with radii, as far as they are known to the digits asked for.

    It outlives the attempts at rising precision: what is known well enough is not recorded again.

    Attributes:
        rows: Values of each impact, in the order of `carom.trace.IMPACT_DTYPE`.
        radii: Their radii, in the same order.
        decimals: Time and velocities after as decimal numbers, for more digits than float64 holds.
        bits: Bits to which balls are converted.
    """

    def __init__(self, scene: Scene, digits: int) -> None:
        self.digits = digits
        self.bits = math.ceil(digits * LOG2_10) + GUARD_BITS
        self.rows: list[tuple[Any, ...]] = []
        self.radii: list[tuple[Any, ...]] = []
        self.decimals: list[tuple[str, ...]] = []
        self._tolerance = arb(10) ** -digits
        speed = max(math.hypot(*disc.velocity_m_s) for disc in scene.discs) or 1.0
        length = max(max(map(abs, disc.position_m)) + disc.radius_m for disc in scene.discs)
        #: How far velocities and positions may be off.
        self._tolerances = (self._tolerance * speed, self._tolerance * length)
        self._pending: list[BallImpact] = []
        self._skip = 0
        self._velocity = [((disc.velocity_m_s), (0.0, 0.0)) for disc in scene.discs]
        self._wall_normals: dict[int, tuple[tuple[float, float], tuple[float, float]]] = {}

    def complete(self) -> int:
        """Return how many impacts are recorded whole; an interrupt may have come in the middle of one."""
        lengths = [len(self.rows), len(self.radii)]
        return min(lengths if self.digits <= MOST_FLOAT_DIGITS else [*lengths, len(self.decimals)])

    def begin_again(self) -> None:
        """Expect the impacts from the first on: those that are recorded are left out."""
        self._pending.clear()
        self._skip = self.complete()

    def add(self, impact: BallImpact) -> None:
        """Append one impact; it is converted later, many at a time."""
        if self._skip:
            self._skip -= 1
        else:
            self._pending.append(impact)

    def convert(self) -> bool:
        """Convert what was added; return False at the first that is not known to the digits asked for."""
        if not self._pending:
            return True
        precision = ctx.prec
        ctx.prec = self.bits
        try:
            return all(self._convert(impact) for impact in self._pending)
        finally:
            ctx.prec = precision
            self._pending.clear()

    def state_is_good(self, bodies: BallBodies) -> bool:
        """Whether the state of every disc is known to the digits asked for."""
        velocities, places = (*bodies.vx, *bodies.vy), (*bodies.x, *bodies.y)
        return all(
            ball.rad() <= tolerance
            for balls, tolerance in zip((velocities, places), self._tolerances, strict=True)
            for ball in balls
        )

    def _convert(self, impact: BallImpact) -> bool:
        time, *after = +impact.time, *(+v for v in impact.after)
        t, t_radius = nearest(time)
        (ax, arx), (ay, ary) = nearest(after[0]), nearest(after[1])
        first, second = impact.first, impact.second
        before_second = after_second = ((0.0, 0.0), (0.0, 0.0))
        widest = max(arx, ary)
        if second >= 0:
            (bx, brx), (by, bry) = nearest(after[2]), nearest(after[3])
            before_second, after_second = self._velocity[second], ((bx, by), (brx, bry))
            widest = max(widest, brx, bry)
        # Float64's own rounding is part of these radii: where it alone decides, the balls' radii are looked at.
        if self._tolerances[0] < widest and not all(v.rad() <= self._tolerances[0] for v in after):
            return False
        if self._tolerance * t < t_radius and not time.rad() <= self._tolerance * t:
            return False
        before_first, self._velocity[first] = self._velocity[first], ((ax, ay), (arx, ary))
        if second >= 0:
            self._velocity[second] = after_second
        if impact.before is not None:
            (bx, brx), (by, bry), (cx, crx), (cy, cry) = (nearest(+v) for v in impact.before)
            before_first, before_second = ((bx, by), (brx, bry)), ((cx, cy), (crx, cry))
        normal = self._normal(impact)
        sides = (normal, before_first, before_second, self._velocity[first], after_second)
        self.rows.append((t, first, second, *(side[0] for side in sides)))
        self.radii.append((t_radius, first, second, *(side[1] for side in sides)))
        if self.digits > MOST_FLOAT_DIGITS:
            self.decimals.append(tuple(v.str(self.digits, radius=False) for v in (time, *after)))
        return True

    def _normal(self, impact: BallImpact) -> tuple[tuple[float, float], tuple[float, float]]:
        if impact.second < 0 and impact.second in self._wall_normals:
            return self._wall_normals[impact.second]
        (x, x_radius), (y, y_radius) = (_quotient(part, impact.length) for part in (impact.nx, impact.ny))
        normal = ((x, y), (x_radius, y_radius))
        if impact.second < 0:
            self._wall_normals[impact.second] = normal
        return normal
