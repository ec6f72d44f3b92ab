"""Compare PIC with brute force on tables drawn by lot: ``python -m tests.campaign.tables --tables 20000``.

Each table is followed by `tests.validation.table_runs`, which shares no code and no formula with Carom, from impact to
impact: walls, times and velocities. It ends where the growth of rounding has passed a thousandth of a disc's radius.
With ``--state`` counts add up from call to call. Exit code 1 tells of a contradiction; which table, and how to see it
again, is printed.
"""

from __future__ import annotations

import argparse
import json
import random
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path

from tests.validation.table_runs import Comparison, Line, Point, Table, compare, scene_of

from carom import SceneError
from carom.support.folders import write_file

#: Impacts of a table at most: what a billiard with such obstacles loses an impact has most of them end before.
MOST = 40
#: Why a table was compared no further, see `Comparison`.
ENDS = ("bound", "most", "near miss", "over", "contradiction")
#: Tables after which the counts are written.
_BETWEEN = 20


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


def driven(rnd: random.Random, table: Table, *, exact: bool) -> Table:
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


def draw(number: int) -> tuple[str, Table] | None:
    """Return a table and its kind, or None where two of its edges cross or the disc overlaps one."""
    kind = list(KINDS)[number % len(KINDS)]
    rnd = random.Random(f"table {number}")
    table = KINDS[kind](rnd)
    if moves := rnd.random() < 0.25:
        table = driven(rnd, table, exact=kind == "joints exact")
    try:
        scene_of(table)
    except SceneError:
        return None
    return f"{kind}{', falling' if any(table.gravity) else ''}{', driven' if moves else ''}", table


@dataclass
class Count:
    """Counts over all tables of a kind; `ends` says how many were compared no further for which of `ENDS`."""

    tables: int = 0
    impacts: int = 0
    ends: dict[str, int] = field(default_factory=lambda: dict.fromkeys(ENDS, 0))
    worst: float = 0.0


@dataclass
class Tally:
    """All that has been compared so far."""

    begun: int = 0
    counts: dict[str, Count] = field(default_factory=dict)
    contradictions: list[int] = field(default_factory=list)

    @property
    def tables(self) -> int:
        """Tables compared."""
        return sum(count.tables for count in self.counts.values())

    @property
    def impacts(self) -> int:
        """Impacts that agree."""
        return sum(count.impacts for count in self.counts.values())

    def add(self, kind: str, number: int, found: Comparison) -> None:
        """Count one table."""
        count = self.counts.setdefault(kind, Count())
        count.tables += 1
        count.impacts += found.agreed
        count.ends[found.ended] += 1
        count.worst = max(count.worst, found.worst)
        if found.ended == "contradiction":
            self.contradictions.append(number)

    def table(self) -> str:
        """Return the counts as a Markdown table."""
        heads = ("tables", "how many", "impacts compared", "bound passed", f"{MOST} impacts", *ENDS[2:], "worst error")
        lines = [f"| {' | '.join(heads)} |", "| --- |" + " ---: |" * (len(heads) - 1)]
        rows = [*sorted(self.counts.items()), ("all", self._all())]
        for kind, count in rows:
            cells = (f"{count.tables:,}", f"{count.impacts:,}", *[f"{count.ends[end]:,}" for end in ENDS])
            lines.append(f"| {kind} | {' | '.join(cells)} | {count.worst:.2f} |")
        return "\n".join(lines)

    def _all(self) -> Count:
        counts = self.counts.values()
        ends = {end: sum(count.ends[end] for count in counts) for end in ENDS}
        return Count(self.tables, self.impacts, ends, max((count.worst for count in counts), default=0.0))

    @classmethod
    def load(cls, path: Path) -> Tally:
        """Return what a file holds, nothing done where there is none."""
        if not path.exists():
            return cls()
        held = json.loads(path.read_text(encoding="utf-8"))
        return cls(**{**held, "counts": {kind: Count(**row) for kind, row in held["counts"].items()}})

    def save(self, path: Path) -> None:
        """Write all to a file, whole or not at all."""
        write_file(path, json.dumps(asdict(self), indent=1) + "\n")


def run_tables(tally: Tally, tables: int, minutes: float, state: Path | None) -> None:
    """Continue up to a number of tables in all, or for some minutes."""
    end = time.monotonic() + 60 * minutes
    while tally.tables < tables and time.monotonic() < end:
        number = tally.begun
        tally.begun += 1
        if (drawn := draw(number)) is None:
            continue
        kind, table = drawn
        found = compare(table, MOST)
        tally.add(kind, number, found)
        if found.ended == "contradiction":
            sys.stderr.write(f"table {number}: {found}\n    again: python -m tests.campaign.tables --table {number}\n")
        if state is not None and tally.tables % _BETWEEN == 0:
            tally.save(state)
    if state is not None:
        tally.save(state)


def main(arguments: Sequence[str] | None = None) -> int:
    """Return 1 where a table contradicts brute force, else 0."""
    parser = argparse.ArgumentParser("python -m tests.campaign.tables", description=__doc__)
    parser.add_argument("--tables", type=int, default=100, help="how many in all, those of --state included (100)")
    parser.add_argument("--minutes", type=float, default=float("inf"), help="for how long at most")
    parser.add_argument("--state", type=Path, help="JSON file in which counts add up from call to call")
    parser.add_argument("--table", type=int, help="compare only the table of this number, and print what it is")
    options = parser.parse_args(arguments)
    tally = Tally() if options.state is None or options.table is not None else Tally.load(options.state)
    if options.table is None:
        run_tables(tally, options.tables, options.minutes, options.state)
    elif (drawn := draw(options.table)) is None:
        print(f"table {options.table} is no scene: two of its edges cross, or the disc overlaps one")
    else:
        found = compare(drawn[1], MOST)
        tally.add(drawn[0], options.table, found)
        print(drawn[1], found, sep="\n")
    print(tally.table())
    print("The worst error is in units of the bound: what rounding of each impact has grown to, to first order.")
    return 1 if tally.contradictions else 0


if __name__ == "__main__":
    sys.exit(main())
