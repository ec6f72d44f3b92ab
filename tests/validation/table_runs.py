"""Brute force on tables of finite walls: one disc with 600 bits, sharing no code and no formula with Carom.

Every edge has a vertex at both of its ends, two sides, and no joint is looked at twice: nothing is merged. An arc's
circle follows from its chord by trigonometry, its sector from angles, and a fall's instant from all roots of a
polynomial. The answer is that of the very floats of the scene.
"""

from collections.abc import Callable, Iterator
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
#: Of a run: a slow disc goes through forty impacts in it.
DURATION_S = 1e6


class Line(NamedTuple):
    """A finite wall: points, bulges, whether it is closed, half width, restitution if not the table's, and its legs.

    A leg is when it begins and a velocity; without any the wall is at rest.
    """

    points: tuple[Point, ...]
    bulges: tuple[float, ...]
    closed: bool
    half_width: float
    restitution: float | None = None
    legs: tuple[tuple[float, Point], ...] = ()


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


class Side(NamedTuple):
    """What may be met of a line: as a function of a state, when, and the normal at a place then, or None."""

    line: int
    meet: Callable[[State], arb | None]
    normal: Callable[[State], tuple[arb, arb]]


class Met(NamedTuple):
    """One impact: with which line, and the state after it."""

    line: int
    state: State


def list_sides(table: Table) -> list[Side]:
    """Return all that may be met in a table."""
    found = []
    for number, line in enumerate(table.lines):
        reach = arb(table.radius) + arb(line.half_width)
        ends = [*line.points[1:], line.points[0]] if line.closed else line.points[1:]
        found += [_circle(table, number, arb(x), arb(y), reach, inside=False, within=None) for x, y in line.points]
        for a, b, bulge in zip(line.points, ends, line.bulges, strict=False):
            found += _straight(table, number, a, b, reach) if bulge == 0.0 else _bent(table, number, a, b, bulge, reach)
    return [_driven(table, side) if table.lines[side.line].legs else side for side in found]


def _iterate_legs(line: Line) -> Iterator[tuple[arb, arb, arb, arb, arb, arb]]:
    """Yield of each leg its beginning and end, how far the line has moved when it begins, and its velocity."""
    x, y = arb(0), arb(0)
    for k, (begin, (u, v)) in enumerate(line.legs):
        end = arb(line.legs[k + 1][0]) if k + 1 < len(line.legs) else arb("inf")
        yield arb(begin), end, x, y, arb(u), arb(v)
        if k + 1 < len(line.legs):
            x, y = x + (end - begin) * u, y + (end - begin) * v


def _relative_state(line: Line, s: State) -> State:
    """Return a state relative to a line, which is where it began."""
    for begin, end, x, y, u, v in _iterate_legs(line):
        if s.time < end:
            lasted = s.time - begin
            return State(s.time, s.x - x - u * lasted, s.y - y - v * lasted, s.vx - u, s.vy - v)
    return s


def _driven(table: Table, side: Side) -> Side:
    """Return the features of a line at rest as those of the moving line, leg by leg."""
    line, (gx, gy) = table.lines[side.line], map(arb, table.gravity)

    def meet(s: State) -> arb | None:
        for begin, end, x, y, u, v in _iterate_legs(line):
            if not s.time < end:
                continue
            idle = begin - s.time if begin > s.time else arb(0)
            at_x, at_y = _moved(table, s, idle)
            lasted = s.time + idle - begin
            vx, vy = s.vx + idle * gx - u, s.vy + idle * gy - v
            wait = side.meet(State(s.time + idle, at_x - x - u * lasted, at_y - y - v * lasted, vx, vy))
            if wait is not None and s.time + idle + wait < end:
                return idle + wait
        return None

    def normal(s: State) -> tuple[arb, arb]:
        return side.normal(_relative_state(line, s))

    return Side(side.line, meet, normal)


def _moved(table: Table, s: State, wait: arb) -> tuple[arb, arb]:
    """Return a disc's place after a wait."""
    gx, gy = map(arb, table.gravity)
    return s.x + wait * (s.vx + wait * gx / 2), s.y + wait * (s.vy + wait * gy / 2)


def _straight(table: Table, line: int, a: Point, b: Point, reach: arb) -> Iterator[Side]:
    length = ((arb(b[0]) - a[0]) ** 2 + (arb(b[1]) - a[1]) ** 2).sqrt()
    tx, ty = (arb(b[0]) - a[0]) / length, (arb(b[1]) - a[1]) / length
    for sign in (1, -1):
        nx, ny = -ty * sign, tx * sign

        def meet(s: State, nx: arb = nx, ny: arb = ny) -> arb | None:
            gx, gy = map(arb, table.gravity)
            powers = [(s.x - a[0]) * nx + (s.y - a[1]) * ny - reach, s.vx * nx + s.vy * ny, (gx * nx + gy * ny) / 2]
            for wait in _find_falling_roots(powers):
                x, y = _moved(table, s, wait)
                if 0 <= (x - a[0]) * tx + (y - a[1]) * ty <= length:
                    return wait
            return None

        def normal(_: State, nx: arb = nx, ny: arb = ny) -> tuple[arb, arb]:
            return nx, ny

        yield Side(line, meet, normal)


def _bent(table: Table, line: int, a: Point, b: Point, bulge: float, reach: arb) -> Iterator[Side]:
    turn = 4 * arb(bulge).atan()
    chord = ((arb(b[0]) - a[0]) ** 2 + (arb(b[1]) - a[1]) ** 2).sqrt()
    radius, height = chord / (2 * (abs(turn) / 2).sin()), chord / 2 * (turn / 2).cos() / (turn / 2).sin()
    x = (arb(a[0]) + b[0]) / 2 - (arb(b[1]) - a[1]) / chord * height
    y = (arb(a[1]) + b[1]) / 2 + (arb(b[0]) - a[0]) / chord * height
    # From the centre to the arc's middle: half a turn from there is the seam of angles, and never the arc.
    mx = (arb(a[0]) + b[0]) / 2 + arb(bulge) * (arb(b[1]) - a[1]) / 2 - x
    my = (arb(a[1]) + b[1]) / 2 - arb(bulge) * (arb(b[0]) - a[0]) / 2 - y

    def within(px: arb, py: arb) -> bool:
        dx, dy = px - x, py - y
        return bool(abs(arb.atan2(mx * dy - my * dx, mx * dx + my * dy)) <= abs(turn) / 2)

    for inside in (True, False):
        if radius - reach > 0 or not inside:
            rim = radius - reach if inside else radius + reach
            yield _circle(table, line, x, y, rim, inside=inside, within=within)


def _circle(
    table: Table, line: int, cx: arb, cy: arb, rim: arb, *, inside: bool, within: Callable[[arb, arb], bool] | None
) -> Side:
    sign = -1 if inside else 1

    def meet(s: State) -> arb | None:
        x, y, ux, uy, (gx, gy) = s.x - cx, s.y - cy, s.vx, s.vy, map(arb, table.gravity)
        powers = [
            x * x + y * y - rim * rim,
            2 * (x * ux + y * uy),
            ux * ux + uy * uy + x * gx + y * gy,
            ux * gx + uy * gy,
            (gx * gx + gy * gy) / 4,
        ]
        for wait in _find_falling_roots([sign * power for power in powers]):
            x, y = _moved(table, s, wait)
            if within is None or within(x, y):
                return wait
        return None

    def normal(s: State) -> tuple[arb, arb]:
        distance = ((s.x - cx) ** 2 + (s.y - cy) ** 2).sqrt()
        return sign * (s.x - cx) / distance, sign * (s.y - cy) / distance

    return Side(line, meet, normal)


def _find_falling_roots(powers: list[arb]) -> list[arb]:
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
        roots = [
            root.real
            for root in acb_poly([acb(power.mid()) for power in powers]).roots(tol=1e-120)
            if root.imag.contains(0)
        ]
    falling = [t for t in roots if t > AT_ONCE and sum(k * p * t ** (k - 1) for k, p in enumerate(powers) if k) < 0]
    return sorted(falling, key=lambda t: float(t.mid()))


def _state_after_impact(table: Table, side: Side, s: State, wait: arb) -> State:
    """Return the state after an impact."""
    gx, gy = map(arb, table.gravity)
    x, y = _moved(table, s, wait)
    vx, vy, time = s.vx + wait * gx, s.vy + wait * gy, s.time + wait
    nx, ny = side.normal(State(time, x, y, vx, vy))
    own = table.lines[side.line].restitution
    seen = _relative_state(table.lines[side.line], State(time, x, y, vx, vy))
    push = (1 + arb(table.restitution if own is None else own)) * (seen.vx * nx + seen.vy * ny)
    return State(time, x, y, vx - push * nx, vy - push * ny)


class Walk:
    """A disc's way from impact to impact."""

    def __init__(self, table: Table) -> None:
        self._table, self._sides = table, list_sides(table)
        self._state = State(arb(0), *map(arb, (*table.place, *table.velocity)))

    def step(self) -> Met | None:
        """Go on through the next impact; None where there is none."""
        found = [(wait, side) for side in self._sides if (wait := side.meet(self._state)) is not None]
        if not found:
            return None
        wait, side = min(found, key=lambda one: float(one[0].mid()))
        end = _state_after_impact(self._table, side, self._state, wait)
        self._state = State(*(value.mid() for value in end))  # some 170 digits: what balls would lose is dropped
        return Met(side.line, end)


def build_table_scene(table: Table) -> Scene:
    """Return a table as a scene."""
    walls = tuple(
        Chain(
            points_m=line.points,
            bulges=line.bulges,
            closed=line.closed,
            half_width_m=line.half_width,
            restitution=line.restitution,
            legs=[{"from_s": begin, "velocity_m_s": velocity} for begin, velocity in line.legs],
        )
        for line in table.lines
    )
    disc = Disc(position_m=table.place, velocity_m_s=table.velocity, radius_m=table.radius)
    return Scene(
        name="random table",
        discs=(disc,),
        walls=walls,
        wall_restitution=table.restitution,
        gravity_m_s2=table.gravity,
        duration_s=DURATION_S,
    )
