"""Log of a certified run: impacts as 64-bit floats with proven error bounds (radii), and as decimal numbers."""

from __future__ import annotations

import math
from typing import NamedTuple

from flint import arb, ctx

from carom.model.scene import Scene
from carom.model.trace import (
    NO_EDGE,
    ImpactRecord,
    ModeRecord,
)
from carom.solvers.certified.ball_arithmetic import divide_to_float, round_to_float
from carom.solvers.certified.contact_state import BallMode
from carom.solvers.certified.disc_states import BallBodies, find_greatest_speed
from carom.solvers.certified.impacts import BallEvent, BallImpact
from carom.solvers.certified.slowing import damped_time, speed_fraction

Spins = tuple[float, float, float, float]

#: Bits of precision for the conversion of numbers, in addition to the bits of the requested digits.
GUARD_BITS = 64
#: Any decimal number with this many digits is restored from the nearest 64-bit float.
MOST_FLOAT_DIGITS = 15
BITS_A_DIGIT = math.log2(10)


class Vector(NamedTuple):
    """A vector as two 64-bit floats, with an error bound for each."""

    value: tuple[float, float]
    radius: tuple[float, float]


class RecordedImpact(NamedTuple):
    """An impact: its numbers, their error bounds, and the time and the state after the impact as decimal numbers."""

    values: ImpactRecord
    radii: ImpactRecord
    decimals: tuple[str, ...]


class RecordedMode(NamedTuple):
    """A change of a disc between flight, sliding, rolling and rest: its numbers, and their error bounds."""

    values: ModeRecord
    radii: ModeRecord


AT_REST = Vector((0.0, 0.0), (0.0, 0.0))


def to_vector(x: arb, y: arb) -> Vector:
    """Convert two intervals to a vector with error bounds."""
    (x_value, x_radius), (y_value, y_radius) = round_to_float(x), round_to_float(y)
    return Vector((x_value, y_value), (x_radius, y_radius))


class Recording:
    """Log of those impacts of a run that are known to the requested digits.

    All attempts of a run, each with a higher precision, use the same log. A new attempt does not record again the
    impacts that the log already contains.

    Attributes:
        digits: Requested decimal digits.
        bits: Precision with which numbers are converted, in bits.
        rows: The impacts, in order.
        mode_rows: The changes of discs between flight, sliding, rolling and rest, in order.
        events: Number of recorded impacts and changes of discs between flight, sliding, rolling and rest.
    """

    def __init__(self, scene: Scene, digits: int) -> None:
        self.digits = digits
        self.bits = math.ceil(digits * BITS_A_DIGIT) + GUARD_BITS
        self.rows: list[RecordedImpact] = []
        self.mode_rows: list[RecordedMode] = []
        self.events = 0
        speed = find_greatest_speed(scene)
        length = max(max(map(abs, disc.position_m)) + disc.radius_m for disc in scene.discs)
        self._damping_per_s = scene.damping_per_s
        self._tolerance = arb(10) ** -digits
        self._speed_tolerance, self._length_tolerance = self._tolerance * speed, self._tolerance * length
        self._pending: list[BallEvent] = []
        self._skip = 0
        self._velocity = [Vector(disc.velocity_m_s, (0.0, 0.0)) for disc in scene.discs]
        self._turns = scene.arrays.turns
        self._radius = [arb(disc.radius_m) for disc in scene.discs]
        self._wall_normals: dict[int, Vector] = {}

    def __len__(self) -> int:
        return len(self.rows)

    def last_s(self) -> float:
        """Return the time of the last event, in seconds; 0 before the first event."""
        impacts, modes = self.rows[-1:], self.mode_rows[-1:]
        return max([0.0, *(row.values.time_s for row in impacts), *(row.values.time_s for row in modes)])

    def begin_again(self) -> None:
        """Prepare for a new attempt, which first repeats the recorded events."""
        self._pending.clear()
        self._skip = self.events

    def add(self, event: BallEvent) -> None:
        """Append an event. A later call of `convert` converts the event to floats."""
        if self._skip:
            self._skip -= 1
        else:
            self._pending.append(event)

    def convert(self) -> bool:
        """Convert the added events to floats. Return False if an event is not known to the requested digits."""
        with ctx.workprec(self.bits):
            try:
                return all(self._record(event) for event in self._pending)
            finally:
                self._pending.clear()

    def is_state_accurate(self, bodies: BallBodies) -> bool:
        """Return whether the state of every disc is known to the requested digits."""
        return (
            all(ball.rad() <= self._speed_tolerance for ball in (*bodies.vx, *bodies.vy))
            and all(ball.rad() <= self._length_tolerance for ball in (*bodies.x, *bodies.y))
            and all(bodies.rim_speed(i).rad() <= self._speed_tolerance for i in range(len(bodies)))
        )

    def _record(self, event: BallEvent) -> bool:
        modes = [self._convert_mode(mode) for mode in event.modes]
        if None in modes or (event.impact is not None and not self._convert_impact(event.impact)):
            return False
        self.mode_rows += [row._replace(values=row.values._replace(impacts=len(self.rows))) for row in modes if row]
        self.events += 1
        return True

    def _convert_mode(self, mode: BallMode) -> RecordedMode | None:
        """Convert a change between flight, sliding, rolling and rest to floats; None if it is not accurate enough."""
        time, spin, spin_rate = +mode.time, +mode.spin, +mode.spin_rate
        place, velocity, acceleration = ([+part for part in vector] for vector in mode[5:8])
        good = (
            time.rad() <= self._tolerance * time
            and (self._radius[mode.disc] * spin).rad() <= self._speed_tolerance
            and all(part.rad() <= self._speed_tolerance for part in velocity)
            and all(part.rad() <= self._length_tolerance for part in place)
        )
        if not good:
            return None
        (t, dt), (w, dw), (a, da) = round_to_float(time), round_to_float(spin), round_to_float(spin_rate)
        x, v, g = (to_vector(*vector) for vector in (place, velocity, acceleration))
        mode_fields = (mode.disc, mode.wall, mode.before, mode.after)
        return RecordedMode(
            ModeRecord(t, 0, *mode_fields, x.value, v.value, g.value, w, a),
            ModeRecord(dt, 0, *mode_fields, x.radius, v.radius, g.radius, dw, da),
        )

    def _convert_impact(self, undamped: BallImpact) -> bool:
        impact = damp_impact(self._damping_per_s, undamped)
        first, second = impact.first, impact.second
        time, *after = +impact.time, *(+v for v in impact.after)
        t, t_radius = round_to_float(time)
        velocities = [to_vector(*after[:2]), to_vector(*after[2:])]
        # The radii are error bounds that include float rounding. Where error bounds exceed the limit, the widths of the
        # intervals are compared with the limit instead.
        widest = max(velocities[0].radius + velocities[1].radius)
        if self._speed_tolerance < widest and not all(v.rad() <= self._speed_tolerance for v in after):
            return False
        discs = [first, second] if second >= 0 else [first]
        spins_after = [+spin for spin in impact.spins_after[: len(discs)]]
        for disc, spin in zip(discs, spins_after, strict=True):
            if not (self._radius[disc] * spin).rad() <= self._speed_tolerance:
                return False
        if self._tolerance * t < t_radius and not time.rad() <= self._tolerance * t:
            return False
        if impact.before is None:
            before = [self._velocity[first], self._velocity[second] if second >= 0 else AT_REST]
        else:
            before = [to_vector(*(+v for v in vector)) for vector in (impact.before[:2], impact.before[2:])]
        self._velocity[first] = velocities[0]
        if second >= 0:
            self._velocity[second] = velocities[1]
        n, v1, v2, w1, w2 = (self._compute_normal(impact), *before, *velocities)
        spins, spin_radii = self._convert_spins(impact)
        velocity_values = (v1.value, v2.value, w1.value, w2.value)
        values = ImpactRecord(t, first, second, n.value, *velocity_values, spins, impact.edge)
        radii = ImpactRecord(t_radius, first, second, n.radius, v1.radius, v2.radius, w1.radius, w2.radius, spin_radii)
        decimals = (time, *after, *(spins_after if self._turns else ())) if self.digits > MOST_FLOAT_DIGITS else ()
        self.rows.append(RecordedImpact(values, radii, tuple(v.str(self.digits, radius=False) for v in decimals)))
        return True

    def _convert_spins(self, impact: BallImpact) -> tuple[Spins | None, Spins | None]:
        """Return the spins before and after an impact, and their error bounds. A wall's spin is 0."""
        if not self._turns:
            return None, None
        (a, ar), (b, br), (c, cr), (d, dr) = (
            round_to_float(+spin) for spin in (*impact.spins_before, *impact.spins_after)
        )
        return (a, b, c, d), (ar, br, cr, dr)

    def _compute_normal(self, impact: BallImpact) -> Vector:
        normal = self._wall_normals.get(impact.second)
        if normal is None:
            (x, x_radius), (y, y_radius) = (divide_to_float(part, impact.length) for part in (impact.nx, impact.ny))
            normal = Vector((x, y), (x_radius, y_radius))
            if impact.second < 0 and impact.edge == NO_EDGE:
                self._wall_normals[impact.second] = normal
        return normal


def damp_impact(damping_per_s: float, impact: BallImpact) -> BallImpact:
    """Convert an impact of the undamped run to the impact of the damped run."""
    if not damping_per_s:
        return impact
    left = speed_fraction(damping_per_s, impact.time)
    return impact._replace(
        time=damped_time(damping_per_s, impact.time),
        after=_scale_all(impact.after, left),
        before=None if impact.before is None else _scale_all(impact.before, left),
        spins_after=(impact.spins_after[0] * left, impact.spins_after[1] * left),
        spins_before=(impact.spins_before[0] * left, impact.spins_before[1] * left),
    )


def _scale_all(parts: tuple[arb, arb, arb, arb], left: arb) -> tuple[arb, arb, arb, arb]:
    a, b, c, d = (part * left for part in parts)
    return a, b, c, d
