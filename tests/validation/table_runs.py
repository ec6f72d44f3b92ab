"""Brute force on tables of finite walls: one disc with 600 bits, sharing no code and no formula with Carom.

Every edge has a vertex at both of its ends and two sides: nothing is merged. An arc's circle follows from its chord by
trigonometry, its sector from angles, and a fall's instant from all roots of a polynomial. The answer is that of the
very floats of the scene.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple

from flint import acb, acb_poly, arb

from carom import Disc, Scene
from carom.model.walls import Chain

Point = tuple[float, float]

#: Bits of a number: forty impacts, each of which may cost ten, leave more than a float has.
PRECISION = 600
#: An instant so soon after an impact is that impact.
AT_ONCE = arb(10) ** -60
#: The legs of a line at rest.
AT_REST: tuple[tuple[float, Point], ...] = ((0.0, (0.0, 0.0)),)
#: Of a run: a slow disc goes through forty impacts in it.
DURATION_S = 1e6


class Line(NamedTuple):
    """A finite wall: points, bulges, whether it is closed, half width, restitution if not the table's, and its legs.

    A leg is when it begins and a velocity.
    """

    points: tuple[Point, ...]
    bulges: tuple[float, ...]
    closed: bool
    half_width: float
    restitution: float | None = None
    legs: tuple[tuple[float, Point], ...] = AT_REST


@dataclass(frozen=True)
class Table:
    """Lines that one disc moves among."""

    lines: tuple[Line, ...]
    place: Point
    velocity: Point
    radius: float
    restitution: float = 1.0
    gravity: Point = (0.0, 0.0)


class State(NamedTuple):
    """A disc at an instant."""

    time: arb
    x: arb
    y: arb
    vx: arb
    vy: arb

    def after(self, wait: arb, gravity: Point) -> "State":
        """Return the state after a free flight."""
        gx, gy = map(arb, gravity)
        x, y = self.x + wait * (self.vx + wait * gx / 2), self.y + wait * (self.vy + wait * gy / 2)
        return State(self.time + wait, x, y, self.vx + wait * gx, self.vy + wait * gy)


class Side(NamedTuple):
    """One side of a straight edge: its beginning, direction, length and normal, and how near the disc's centre gets."""

    x: arb
    y: arb
    tx: arb
    ty: arb
    length: arb
    nx: arb
    ny: arb
    reach: arb

    def gap_powers(self, s: State, gx: arb, gy: arb) -> list[arb]:
        """Return the gap of a falling disc as a polynomial in time, which may also be of another sign and scale."""
        gap = (s.x - self.x) * self.nx + (s.y - self.y) * self.ny - self.reach
        return [gap, s.vx * self.nx + s.vy * self.ny, (gx * self.nx + gy * self.ny) / 2]

    def is_met_at(self, x: arb, y: arb) -> bool:
        return bool(0 <= (x - self.x) * self.tx + (y - self.y) * self.ty <= self.length)

    def normal_at(self, _x: arb, _y: arb) -> tuple[arb, arb]:
        return self.nx, self.ny


class Round(NamedTuple):
    """A vertex, or one side of an arc, whose middle is in a direction from its centre and which turns by an angle."""

    x: arb
    y: arb
    rim: arb
    sign: int = 1
    middle: tuple[arb, arb] = (arb(1), arb(0))
    turn: arb = arb(100)

    def gap_powers(self, s: State, gx: arb, gy: arb) -> list[arb]:
        """Return the square of the distance to the centre less that of the rim, negated inside of an arc."""
        x, y = s.x - self.x, s.y - self.y
        powers = [x * x + y * y - self.rim * self.rim, 2 * (x * s.vx + y * s.vy)]
        powers += [s.vx * s.vx + s.vy * s.vy + x * gx + y * gy, s.vx * gx + s.vy * gy, (gx * gx + gy * gy) / 4]
        return [self.sign * power for power in powers]

    def is_met_at(self, x: arb, y: arb) -> bool:
        (mx, my), dx, dy = self.middle, x - self.x, y - self.y
        return bool(abs(arb.atan2(mx * dy - my * dx, mx * dx + my * dy)) <= self.turn / 2)

    def normal_at(self, x: arb, y: arb) -> tuple[arb, arb]:
        distance = ((x - self.x) ** 2 + (y - self.y) ** 2).sqrt()
        return self.sign * (x - self.x) / distance, self.sign * (y - self.y) / distance


def list_features(line: Line, radius: float) -> list[Side | Round]:
    """Return all that a disc may meet of a line."""
    reach = arb(radius) + arb(line.half_width)
    ends = [*line.points[1:], line.points[0]] if line.closed else line.points[1:]
    found: list[Side | Round] = [Round(arb(x), arb(y), reach) for x, y in line.points]
    for (ax, ay), (bx, by), bulge in zip(line.points, ends, line.bulges, strict=False):
        length = ((arb(bx) - ax) ** 2 + (arb(by) - ay) ** 2).sqrt()
        tx, ty = (arb(bx) - ax) / length, (arb(by) - ay) / length
        if bulge == 0.0:
            found += [Side(arb(ax), arb(ay), tx, ty, length, -ty * k, tx * k, reach) for k in (1, -1)]
            continue
        turn = 4 * arb(bulge).atan()
        arc_radius, height = length / (2 * (abs(turn) / 2).sin()), length / 2 * (turn / 2).cos() / (turn / 2).sin()
        x, y = (arb(ax) + bx) / 2 - ty * height, (arb(ay) + by) / 2 + tx * height
        # From the centre to the arc's middle: half a turn from there is the seam of angles, and never the arc.
        middle = (arb(ax) + bx) / 2 + bulge * ty * length / 2 - x, (arb(ay) + by) / 2 - bulge * tx * length / 2 - y
        found.append(Round(x, y, arc_radius + reach, 1, middle, abs(turn)))
        if arc_radius - reach > 0:
            found.append(Round(x, y, arc_radius - reach, -1, middle, abs(turn)))
    return found


def find_falling_roots(powers: list[arb]) -> list[arb]:
    """Return the roots after now at which a polynomial falls, in their order."""
    while powers and powers[-1] == 0:
        powers = powers[:-1]
    if len(powers) < 2:
        return []
    if len(powers) == 2:
        roots = [-powers[0] / powers[1]]
    elif len(powers) == 3:
        c, b, a = powers
        square = b * b - 4 * a * c
        roots = [(-b + sign * square.sqrt()) / (2 * a) for sign in (1, -1)] if square > 0 else []
    else:
        found = acb_poly([acb(power.mid()) for power in powers]).roots(tol=1e-120)
        roots = [root.real for root in found if root.imag.contains(0)]
    falling = [t for t in roots if t > AT_ONCE and sum(k * p * t ** (k - 1) for k, p in enumerate(powers) if k) < 0]
    return sorted(falling, key=lambda t: float(t.mid()))


def meet(table: Table, line: Line, feature: Side | Round, s: State) -> State | None:
    """Return the state after the next impact on a feature of a line; None where there is none."""
    gx, gy = map(arb, table.gravity)
    shift_x, shift_y = arb(0), arb(0)
    for k, (begin, (u, v)) in enumerate(line.legs):
        end = arb(line.legs[k + 1][0]) if k + 1 < len(line.legs) else arb("inf")
        if s.time < end:
            # In the frame of the line, from now or the leg's beginning on.
            here = s.after(begin - s.time if begin > s.time else arb(0), table.gravity)
            x, y = here.x - shift_x - u * (here.time - begin), here.y - shift_y - v * (here.time - begin)
            seen = State(here.time, x, y, here.vx - u, here.vy - v)
            for wait in find_falling_roots(feature.gap_powers(seen, gx, gy)):
                hit = seen.after(wait, table.gravity)
                if hit.time < end and feature.is_met_at(hit.x, hit.y):
                    nx, ny = feature.normal_at(hit.x, hit.y)
                    restitution = table.restitution if line.restitution is None else line.restitution
                    push = (1 + arb(restitution)) * (hit.vx * nx + hit.vy * ny)
                    before = here.after(wait, table.gravity)
                    return before._replace(vx=before.vx - push * nx, vy=before.vy - push * ny)
        shift_x, shift_y = shift_x + (end - begin) * u, shift_y + (end - begin) * v
    return None


def iterate_impacts(table: Table) -> Iterator[tuple[int, State]]:
    """Yield the impacts of the disc: with which line, and the state after it."""
    features = [(k, one) for k, line in enumerate(table.lines) for one in list_features(line, table.radius)]
    state = State(arb(0), *map(arb, (*table.place, *table.velocity)))
    while True:
        met = [
            (after, number)
            for number, feature in features
            if (after := meet(table, table.lines[number], feature, state)) is not None
        ]
        if not met:
            return
        after, number = min(met, key=lambda one: float(one[0].time.mid()))
        yield number, after
        state = State(*(value.mid() for value in after))  # some 170 digits: what balls would lose is dropped


def build_table_scene(table: Table) -> Scene:
    """Return a table as a scene."""
    walls = tuple(
        Chain(
            points_m=line.points,
            bulges=line.bulges,
            closed=line.closed,
            half_width_m=line.half_width,
            restitution=line.restitution,
            legs=[{"from_s": begin, "velocity_m_s": velocity} for begin, velocity in line.legs if line.legs != AT_REST],
        )
        for line in table.lines
    )
    disc = Disc(position_m=table.place, velocity_m_s=table.velocity, radius_m=table.radius)
    laws = {"wall_restitution": table.restitution, "gravity_m_s2": table.gravity, "duration_s": DURATION_S}
    return Scene(name="random table", discs=(disc,), walls=walls, **laws)
