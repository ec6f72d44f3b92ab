"""The moving state of discs that fall: parabolas between frames, and what a wall does to them."""

from __future__ import annotations

from typing import TYPE_CHECKING

from carom.core import primitives
from carom.solvers.plain.bodies import Bodies
from carom.solvers.plain.instants import START, Instant, between

if TYPE_CHECKING:
    from carom.solvers.run import Start


class FallingBodies(Bodies):
    """Positions and velocities under gravity; position and velocity of a disc are those of its own instant."""

    def __init__(self, start: Start) -> None:
        super().__init__(start)
        self.gravity = start.gravity_m_s2
        self.rolling_resistance = start.wall_rolling_resistance
        self.acceleration = [self.gravity if mass else (0.0, 0.0) for mass in self.inverse_mass]
        self.instant = [START] * len(self)

    def state_at(self, i: int, instant: Instant) -> tuple[float, float, float, float]:
        """Position and velocity of disc `i` at an instant, on its present parabola."""
        if self.inverse_mass[i] == 0.0:
            return self.driven_at(i, instant[0])
        if instant == self.instant[i]:
            return self.x[i], self.y[i], self.vx[i], self.vy[i]
        dt = between(self.instant[i], instant)
        gx, gy = self.acceleration[i]
        return (
            self.x[i] + dt * (self.vx[i] + 0.5 * gx * dt),
            self.y[i] + dt * (self.vy[i] + 0.5 * gy * dt),
            self.vx[i] + gx * dt,
            self.vy[i] + gy * dt,
        )

    def bring_to(self, i: int, instant: Instant) -> None:
        """Bring disc `i` to an instant along its parabola."""
        if self.inverse_mass[i] == 0.0:
            self.x[i], self.y[i], self.vx[i], self.vy[i] = self.state_at(i, instant)
        else:
            self.x[i], self.y[i], self.vx[i], self.vy[i] = self.state_at(i, instant)
            self.instant[i] = instant
            self.time[i] = instant[0]

    def move_to(self, i: int, time_s: float) -> None:
        """Bring disc `i` to `time_s` along its parabola."""
        self.bring_to(i, (time_s, 0.0))

    def rubs_on(self, k: int) -> bool:
        """Whether an impact on wall `k` changes more than the speed along its normal."""
        return super().rubs_on(k) or self.rolling_resistance > 0.0

    def slide_on_wall(self, i: int, k: int, before: tuple[float, float], pressed: float) -> None:
        """Let the friction of a wall act, as without gravity, and its rolling resistance."""
        (nx, ny), y = self.normal(i, k), self.inverse_inertia_ratio[i]
        rim, slip = self.radius[i] * self.spin[i], self.slip(i, k, before)
        friction, rolling, blocks = primitives.frictional_impulses(
            *self.contact_of_wall(k), self.rolling_resistance, slip, rim, y, pressed
        )
        self.vx[i] -= friction * ny
        self.vy[i] += friction * nx
        self.spin[i] = 0.0 if blocks else self.spin[i] - (friction + rolling) * y / self.radius[i]
