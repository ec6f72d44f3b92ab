"""Where the event-driven kernel keeps what: offsets into its flat columns. One row of 64 bytes a disc, one cache line.

A column is a plain list where the kernel runs as plain Python, and a pointer into an array where it is compiled (which
spares a compiler the bookkeeping of a dozen arrays); the kernel can't tell. A column knows no length: `size`
holds those.
"""

from __future__ import annotations

from typing import Any, NamedTuple

__all__: list[str] = []

#: A flat sequence of numbers: a list where the kernel runs as plain Python, a pointer where it is compiled.
Column = Any


class Columns(NamedTuple):
    """All columns of a run.

    Attributes:
        body: Paths.
        link: Cells and predictions.
        cells: Which discs are in each cell, and from `size[CHAINS]` on, what follows a disc in a crowded one.
        nearby: Scratch: the numbers of the discs that a scan has found.
        field: Scratch: how these move relative to the one that looks, and bounds on when they meet.
        walls: A point and a normal each.
        near_wall: Which walls are near each cell.
        inverse_mass: 1/kg, 0 for a disc that never moves.
        last_impact: Time of each disc's last impact, where a contact takes time (TC model), else empty.
        tree: Tournament tree of the earliest predicted time of each disc.
        winner: The disc that each least time in it belongs to.
        clock: Times.
        tally: Counts.
        law: Restitution, where the cells lie, and the window of the impacts that are kept.
        size: How much there is of everything.
        records: Room for impacts; none are kept where it is empty.
    """

    body: Column
    link: Column
    cells: Column
    nearby: Column
    field: Column
    walls: Column
    near_wall: Column
    inverse_mass: Column
    last_impact: Column
    tree: Column
    winner: Column
    clock: Column
    tally: Column
    law: Column
    size: Column
    records: Column


def index(number: int) -> int:
    """Return a number out of an integer column; compiled, in the width that all indices have."""
    return number + 0


ROW = 8  # floats of a disc in `body`, and integers of a disc in `link`

# body: the path of a disc, and what is next on it. Position is that at the disc's own time, the instant of its last
# impact. PAIR is when it next meets another disc, LEAVE when it leaves its cell or meets a wall.
X, Y, VX, VY, OWN_TIME, RADIUS, PAIR, LEAVE = range(8)

# link: where a disc stands, and what was predicted for it. CELL holds row and column, 16 bits each: taking them apart
# again must not cost a division. VERSION counts the disc's impacts. LAST is the body that it met
# last; walls are numbered on from the discs there. MOVES is 0 for a disc that never does.
CELL, PARTNER, PARTNER_VERSION, EXACT, VERSION, EXIT, LAST, MOVES = range(8)

# cells: room for four discs each. Where there are more, the last one, from CHAINED down, stands for a chain of discs.
SLOTS = 2
CHAINED = -2

# field: what a scan knows of up to BATCH discs, one after another: place and velocity relative to the disc that looks,
# contact distance, instant from which they are counted, and bounds on the time of impact.
BATCH = 64
DX, DY, UX, UY, REACH, START, LOW, HIGH = range(0, 8 * BATCH, BATCH)
FIELD = 8 * BATCH

NOBODY = -1  # no partner, no neighbour in the list, no impact yet

COLUMN_BITS = 16
COLUMN_MASK = (1 << COLUMN_BITS) - 1
MOST_COLUMNS = (1 << (COLUMN_BITS - 1)) - 2  # of cells in either direction, the ring around them left out

# EXIT: the next thing that ends a disc's stay in its cell: an edge, or (from WALL on) a wall.
LEFT, RIGHT, DOWN, UP, WALL = range(5)

# walls: a point, and the unit normal.
POINT_X, POINT_Y, NORMAL_X, NORMAL_Y = range(4)
WALL_ROW = 4

LAST_BIT = 7  # of `near_wall`: a bit a wall of each cell, the last one for all that are left

# clock: times since the epoch, but for the epoch itself (a pair of floats) and the last time reported.
NOW, EPOCH, EPOCH_REST, REPORTED, PUSHED = range(5)
CLOCKS = 5

# law: what the impacts obey, where the cells lie, and which impacts are kept.
RESTITUTION, WALL_RESTITUTION, CONTACT_TIME, CORNER_X, CORNER_Y, WIDTH, KEEP_FROM, KEEP_TO = range(8)

# size: how much there is of everything; AHEAD is 1 where it pays to look ahead; from OFFSET on, where each level of the
# tree begins.
DISCS, WALLS, COLUMNS, ROWS, STRIDE, CHAINS, CAPACITY, AHEAD, TOP, OFFSET = range(10)

# tally: work counts, and the counts by which a run is judged.
(
    TOTAL,
    SINCE_EPOCH,
    AT_INSTANT,
    WALL_IMPACTS,
    CROSSINGS,
    STALE,
    PREDICTIONS,
    RECORDED,
    TIES,
    EPOCHS,
    READY,
) = range(11)
TALLIES = 11

# record: one row an impact: time, first, second, normal, velocities before and after, and how well the
# instant is known.
RECORD = 14

# What the next event of a disc asks for: it leaves its cell; its impact may be one with a partner that moved on, is
# known by bounds only, or is certain. And what follows for its predictions: all of them are made anew, three more cells
# are looked at, or just the time of its next event is another.
LEAVES, GUESSED, BOUNDED, CERTAIN, ANEW, EDGE, LATER = range(7)

# How `run` ended.
DONE, FULL, LIMIT, STANDSTILL = range(4)
