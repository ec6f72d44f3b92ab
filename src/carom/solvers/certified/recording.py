"""From balls to float64 numbers with proven radii, and to decimal numbers of proven digits."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from flint import arb, ctx

if TYPE_CHECKING:
    from carom.scene import Scene
    from carom.solvers.certified.bodies import BallBodies, BallImpact

__all__ = ["Recording", "nearest"]

#: Bits kept of a ball beyond the digits asked for.
GUARD_BITS = 64
LOG2_10 = math.log2(10)


def nearest(ball: arb) -> tuple[float, float]:
    """Return the float64 nearest to a ball's middle, and how far from it the truth can be.

    The middle is an integer times a power of two, which Python rounds correctly; the radius has 30 bits, so it is a
    float64. Conversion by ``float(ball)`` would cut off.
    """
    mantissa, exponent = ball.mid().man_exp()
    whole, power = int(mantissa), int(exponent)
    excess = max(0, whole.bit_length() - 1000)  # beyond float64's range as an integer: 1000 bits are enough
    value = math.ldexp(float(whole >> excess), power + excess)
    radius = float(ball.rad())
    if whole.bit_length() > 53 or power < -1000:
        radius = math.nextafter(radius + 0.5 * math.ulp(value) * (1.0 + 2.0**-40), math.inf)
    return value, radius


class Recording:
    """The impacts of a run as float64 numbers with radii, as far as they are within what was asked for.

    Attributes:
        rows: Values of each impact, in the order of `carom.trace.IMPACT_DTYPE`.
        radii: Their radii, in the same order.
        good: How many impacts, from the first, have all their radii within the digits asked for.
        bits: Bits to which balls are kept while they wait to be converted.
    """

    def __init__(self, scene: Scene, digits: int) -> None:
        self.digits = digits
        self.bits = math.ceil(digits * LOG2_10) + GUARD_BITS
        self.rows: list[tuple[object, ...]] = []
        self.radii: list[tuple[object, ...]] = []
        self.decimals: list[tuple[str, ...]] = []
        self.good = 0
        self.tolerance = 10.0**-digits
        self.speed = max(math.hypot(*disc.velocity_m_s) for disc in scene.discs) or 1.0
        self.length = max(max(map(abs, disc.position_m)) + disc.radius_m for disc in scene.discs)
        self._pending: list[BallImpact] = []
        self._velocity = [((disc.velocity_m_s), (0.0, 0.0)) for disc in scene.discs]

    def __len__(self) -> int:
        return len(self.rows) + len(self._pending)

    def add(self, impact: BallImpact) -> None:
        """Append one impact; it is converted later, many at a time."""
        self._pending.append(impact)

    def convert(self) -> bool:
        """Convert what was added; return whether all impacts so far are within the digits asked for."""
        precision = ctx.prec
        ctx.prec = self.bits
        try:
            for impact in self._pending:
                self._convert(impact)
        finally:
            ctx.prec = precision
        self._pending.clear()
        return self.good == len(self.rows)

    def state_is_good(self, bodies: BallBodies) -> bool:
        """Whether the state of every disc is known to the digits asked for."""
        velocities, places = (*bodies.vx, *bodies.vy), (*bodies.x, *bodies.y)
        return all(
            float(ball.rad()) <= self.tolerance * scale
            for balls, scale in ((velocities, self.speed), (places, self.length))
            for ball in balls
        )

    def _convert(self, impact: BallImpact) -> None:
        time, nx, ny = +impact.time, +impact.nx, +impact.ny
        length = (nx * nx + ny * ny).sqrt()
        (t, t_radius), (x, x_radius), (y, y_radius) = nearest(time), nearest(nx / length), nearest(ny / length)
        after = [+v for v in impact.after]
        (ax, arx), (ay, ary) = nearest(after[0]), nearest(after[1])
        first, second = impact.first, impact.second
        before_first = self._velocity[first]
        self._velocity[first] = ((ax, ay), (arx, ary))
        before_second = after_second = ((0.0, 0.0), (0.0, 0.0))
        if second >= 0:
            (bx, brx), (by, bry) = nearest(after[2]), nearest(after[3])
            before_second, after_second = self._velocity[second], ((bx, by), (brx, bry))
            self._velocity[second] = after_second
        sides = (before_first, before_second, self._velocity[first], after_second)
        self.rows.append((t, first, second, (x, y), *(side[0] for side in sides)))
        self.radii.append((t_radius, first, second, (x_radius, y_radius), *(side[1] for side in sides)))
        widest = max(float(v.rad()) for v in after)
        within = widest <= self.tolerance * self.speed and float(time.rad()) <= self.tolerance * t
        if within and self.good == len(self.rows) - 1:
            self.good += 1
        if self.digits > 15:
            self.decimals.append(tuple(v.str(self.digits, radius=False) for v in (time, *after)))
