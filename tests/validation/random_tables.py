"""Random tables of finite walls, each drawn from its number alone, for `tests.validation.table_runs`."""

import random
from collections.abc import Callable
from dataclasses import replace

from tests.validation.table_runs import Line, Point, Table, build_table_scene

from carom import SceneError


def random_table(rnd: random.Random) -> Table:
    """Return a table with bulges of both signs, re-entrant joints, a thick bar, an island, and an open arc."""

    def about(x: float, y: float) -> Point:
        return x + rnd.uniform(-0.7, 0.7), y + rnd.uniform(-0.7, 0.7)

    corners = ((-8, -8), (0, -9), (8, -8), (9, 0), (8, 8), (0, 7), (-8, 8), (-7, 0))
    rim = tuple(rnd.choice((0.0, rnd.uniform(-0.3, 0.5))) for _ in corners)
    lines = (
        Line(tuple(about(*corner) for corner in corners), rim, closed=True, half_width=0.0),
        Line((about(-3, -3), about(-1, -4), about(0, -2)), (0.0, 0.0), closed=False, half_width=rnd.uniform(0.05, 0.3)),
        Line((about(3, 3), about(4, 1), about(2, 1)), (0.4, 0.0, -0.3), closed=True, half_width=0.125),
        Line((about(-4, 3), about(-2, 4)), (rnd.uniform(-1.5, 1.5),), closed=False, half_width=0.1),
    )
    place, velocity = (rnd.uniform(-0.5, 0.5), rnd.uniform(-0.5, 0.5)), (rnd.gauss(0, 1), rnd.gauss(0, 1))
    falls = rnd.random() < 0.25
    restitution = 1.0 if falls else rnd.choice((1.0, 0.9))
    return Table(lines, place, velocity, 0.2, restitution, (rnd.gauss(0, 0.3), -1.0) if falls else (0.0, 0.0))


def exact_table(rnd: random.Random) -> Table:
    """Return a table of dyadic numbers: a stadium with cut sides, a cross, a bar of three in line, and a circle.

    Joints are exactly straight or exactly tangent there, the circle's halves are exactly of one circle, and the cross
    has right angles that open inwards; walls have restitutions of their own.
    """

    def dyadic(low: float, high: float) -> float:
        return rnd.randint(int(16 * low), int(16 * high)) / 16

    def cut(a: Point, b: Point) -> list[Point]:
        """Return the points of a straight side from a on, without b: of 1, 2, 4 or 8 pieces."""
        pieces = 2 ** rnd.randint(0, 3)
        return [(a[0] + (b[0] - a[0]) * k / pieces, a[1] + (b[1] - a[1]) * k / pieces) for k in range(pieces)]

    own = None if rnd.random() < 0.5 else rnd.choice((1.0, 0.9375))
    wide, high = dyadic(6, 9), dyadic(5, 7)
    floor, ceiling = cut((-wide, -high), (wide, -high)), cut((wide, high), (-wide, high))
    bend = rnd.choice((1.0, -0.25, 0.25))  # half circles with common tangents, or arcs that are met at corners
    rim = Line(
        (*floor, (wide, -high), *ceiling, (-wide, high)),
        (*[0.0] * len(floor), bend, *[0.0] * len(ceiling), bend),
        closed=True,
        half_width=rnd.choice((0.0, 0.125)),
        restitution=own,
    )
    x, y, arm, thin = -3.0 + dyadic(-0.5, 0.5), dyadic(-1, 1), dyadic(0.75, 1.25), dyadic(0.125, 0.5)
    corners = ((-1, -1), (1, -1), (1, 1), (-1, 1))
    cross = [
        (x + sx * across, y + sy * along)
        for sx, sy in corners
        for across, along in (((thin, arm), (thin, thin), (arm, thin))[:: -sx * sy])
    ]
    begin, step = (2.0 + dyadic(0, 1), 2.0 + dyadic(-0.5, 0.5)), (dyadic(-0.5, 0.5), dyadic(0.125, 0.5))
    bar = tuple((begin[0] + k * step[0], begin[1] + k * step[1]) for k in range(3))
    centre, radius = (dyadic(2, 3.5), -2.5 + dyadic(-0.25, 0.25)), dyadic(0.25, 1)
    halves = tuple((centre[0] + side * radius, centre[1]) for side in (-1, 1))
    lines = (
        rim,
        Line(tuple(cross), (0.0,) * len(cross), closed=True, half_width=rnd.choice((0.0, 0.0625))),
        Line(bar, (0.0, 0.0), closed=False, half_width=rnd.choice((0.0, 0.25)), restitution=own),
        Line(halves, (1.0, 1.0), closed=True, half_width=0.0),
    )
    place, velocity = (rnd.uniform(-0.5, 0.5), rnd.uniform(-0.5, 0.5)), (rnd.gauss(0, 1), rnd.gauss(0, 1))
    gravity = (0.0, -1.0) if rnd.random() < 0.25 else (0.0, 0.0)
    return Table(lines, place, velocity, rnd.choice((0.05, 0.25, 0.6)), 1.0, gravity)


def drive_lines(rnd: random.Random, table: Table, *, exact: bool) -> Table:
    """Return a table of which all lines but the rim are driven, each on legs of its own."""

    def speed() -> float:
        return rnd.randint(-8, 8) / 16 if exact else rnd.gauss(0, 0.3)

    def legs() -> tuple[tuple[float, Point], ...]:
        begins = sorted({rnd.randint(1, 320) / 16 if exact else rnd.uniform(0, 20) for _ in range(rnd.randint(0, 8))})
        return tuple((begin, (speed(), speed())) for begin in (0.0, *begins))

    rim, *others = table.lines
    return replace(table, lines=(rim, *(line._replace(legs=legs()) for line in others)))


#: What is drawn, by name: table n is of kind n modulo their number.
KINDS: dict[str, Callable[[random.Random], Table]] = {"joints anywhere": random_table, "joints exact": exact_table}


def draw_table(number: int) -> tuple[str, Table] | None:
    """Return a table and its kind, or None where two of its edges cross or the disc overlaps one."""
    kind = list(KINDS)[number % len(KINDS)]
    rnd = random.Random(f"table {number}")
    table = KINDS[kind](rnd)
    if moves := rnd.random() < 0.25:
        table = drive_lines(rnd, table, exact=kind == "joints exact")
    try:
        build_table_scene(table)
    except SceneError:
        return None
    return f"{kind}{', falling' if any(table.gravity) else ''}{', driven' if moves else ''}", table
