"""What the event-driven kernel keeps, and in which words: to be read before its other rooms.

Units are metres, metres a second and kilograms. A `time` is seconds since the present epoch, unless it is said to be
since the start: see `Clock`. Walls, spins, the law and recorded impacts are those of every solver: `impact/structs.pxd`.
"""

from carom.constants cimport INF
from carom.physics.features cimport Feature
from carom.solvers.impact.structs cimport (
    NO_FEATURE, NOBODY, Before, Body, Impact, Index, Law, Recent, Record, Spins, Surface, Turning,
    Wall,
)

cdef enum:
    NO_OBSTACLE = -1
    NO_BODY = -2147483648  # neither disc nor wall: nothing has been met yet

    PLACES = 2  # for discs in a cell; more are in a chain, see `Cell`
    MOST_COLUMNS = 32766  # of a grid, and most rows: with the ring around, 16 bits each number a cell
    COLUMN_BITS = 16
    COLUMN_MASK = 0xFFFF
    MOST_OBSTACLES = 32767  # `Prediction.obstacle` is a short
    OUTWARD = 2  # widths of a cell by which the lists of cells at the rim hold beyond it: a row that a gas leaves empty
    EMPTY_LIST = 0  # of `Grid.lists`
    FULL_LIST = 1

    SIBLINGS = 8  # times that the event queue compares with one another: a cache line
    LEVELS = 11  # of the event queue: 8^10 discs are 10^9
    BATCH = 64  # discs that a scan looks at in one go: nine cells of two places hold 18
    LANES = 4  # candidates whose times are bounded together


# ---- events ----

cdef enum Edge:  # of a cell
    NO_EDGE = -1
    LEFT = 0
    RIGHT = 1
    DOWN = 2
    UP = 3

cdef enum EventKind:  # what a disc's next event is, as far as that is known
    START = 0  # of an epoch: nothing has been predicted for the disc
    CROSSING = 1  # it leaves its cell
    STALE = 2  # an impact with a disc whose path has changed since it was predicted
    BOUNDED = 3  # an impact with a disc, of whose time a lower bound is known
    PAIR_IMPACT = 4  # an impact with a disc, certain
    WALL_IMPACT = 5  # an impact on an obstacle, certain
    POSTPONED = 6  # none for now: its time has been found to be later than it seemed

cdef enum Change:  # what an event changes of a disc's future
    OF_PATH = 0  # everything
    OF_PARTNER = 1  # its next impact
    OF_CELL = 2  # three more cells are near it, and it will leave another one
    OF_TIME = 3  # no more than the time of its next event, as the queue knows it

cdef enum Ending:  # of a call of the loop; run.py has the same numbers
    DONE = 0  # no impact is left up to the time asked for
    LIMIT = 1  # there would be one, but there have been as many as were asked for
    STANDSTILL = 2  # time no longer advances
    PAUSE = 3  # as many events have been dealt with as were asked for
    NO_MEMORY = 4  # for another recorded impact
    GLIDES = 5  # a disc comes to glide along an arc: contact, and no impact
    CRUSHED = 6  # a disc has no room left before the end
    OUTGROWN = 7  # cells are to be chosen anew, as discs have been looked after beyond them: see grid.pxd

cdef struct Event:
    EventKind kind
    Index disc


# ---- discs and walls ----

cdef struct Disc:  # 64 bytes, one cache line: all that a disc's neighbours look at
    double x  # centre at `time`
    double y
    double vx  # velocity
    double vy
    double time  # own time: that of its last impact, 0 if there was none in this epoch or if it never moves
    double radius
    double inverse_mass  # 0: it never moves
    int impacts  # how many it has had: tells a stale prediction
    int last  # disc that it met last, or -1 - that obstacle, or NO_BODY

cdef struct Prediction:  # 32 bytes: what comes next for a disc
    double impact_time  # when it meets `partner`: the time itself if `exact`, else a lower bound; INF for never
    double exit_time  # when it crosses `edge`, or meets `obstacle` before it would cross one
    int partner  # disc, or NOBODY
    int partner_impacts  # `impacts` of the partner when this was predicted
    int cell  # in which it is: row << COLUMN_BITS | column, the ring around the grid counted
    short obstacle  # of `exit_time`, NO_OBSTACLE where that is of an edge
    signed char edge  # of `exit_time`, NO_EDGE where that is of an obstacle
    signed char exact  # whether `impact_time` is the time itself

# ---- what is driven ----

cdef struct Leg:  # of a driven body's path
    double begin  # since the epoch
    double end  # INF for the last
    double begins  # the same two since the start
    double ends
    double moved_x  # how far the body has moved when it begins, metres
    double moved_y
    double vx
    double vy

cdef struct Driven:  # a body that is driven, or a wall whose surface runs
    Index body  # disc, or -1 - that wall
    Index first_leg  # of its path
    Index leg_count  # 0 where only its surface moves
    Index first_feature  # of a wall
    Index feature_count
    double x  # of a disc, where it was at the start
    double y
    double belt  # of a wall: see `Surface`

cdef struct Driving:
    Driven *rows  # walls, then discs, each in ascending order
    Leg *legs
    Index count  # of rows
    Index leg_count

cdef struct ToAndFro:  # how often in a row a disc has gone from one body to one exactly opposite, and back
    int last  # body that it struck last, or NO_BODY
    int last_obstacle  # as which that is numbered, NO_OBSTACLE for a disc
    int across  # the same of the other side, in this row
    int across_obstacle
    double nx  # unit vector from the last to the disc
    double ny
    Index row

#: Whether a disc that has gone to and fro for long is crushed before what is asked for ends.
ctypedef bint (*Crushes)(void *asked, int disc) noexcept nogil


# ---- cells ----

cdef struct Cell:  # 8 bytes
    int disc[PLACES]  # NOBODY where empty; CHAINED - i in the last place where a chain follows, beginning with disc i

cdef enum:
    CHAINED = -2

cdef struct Box:
    double left
    double right
    double low
    double high

cdef struct Grid:  # of square cells, in a ring of cells that stay empty
    Cell *cells  # row by row, with the ring
    int *chain  # the disc that follows a disc in its cell's chain, or NOBODY
    unsigned int *list_of  # of a tile: twice the place in `lists` where the numbers of the obstacles begin that a disc in
    # it may meet, and 1 where it is at the rim: 0 for most, where nothing is looked at
    int *lists  # ascending, NO_OBSTACLE at the end of each: see obstacles.pxd
    Index listed  # numbers in `lists`
    Index list_capacity
    Box area  # in which the lists hold
    double x0  # lower left corner of the first cell within the ring
    double y0
    double width  # of a cell
    double radius  # of the largest disc
    double reach  # the largest sum of two radii
    double factor  # on the width of a cell
    Index predictions  # of the run, when the cells were chosen
    Index beyond  # likewise, of those that looked beyond the area of the lists
    Index beyond_limit  # how many more of these until the cells are chosen anew
    Index columns  # without the ring
    Index rows
    Index stride  # from a cell to the one above it
    Index tiles  # in a line: see `tile_of` in grid.pxd

cdef struct Block:  # cells that a scan looks through: lines of three
    Index first
    Index lines
    Index to_line  # from a line to the next
    Index to_cell  # from a cell of a line to the next


# ---- a scan for a disc's next impact ----

cdef struct Candidate:  # an impact that a disc may have next
    double low  # bounds on its time, equal where it is exact; INF for never
    double high
    Index partner

cdef struct Candidates:  # what a scan has found, in columns; one more may be written than counts
    int disc[BATCH + LANES]
    double dx[BATCH + LANES]  # centre as seen from the disc that looks, at `start`
    double dy[BATCH + LANES]
    double ux[BATCH + LANES]  # velocity as seen from it
    double uy[BATCH + LANES]
    double reach[BATCH + LANES]  # sum of the radii
    double start[BATCH + LANES]  # the later of the two discs' own times
    double low[BATCH + LANES]  # bounds on the time of impact, as those of a `Candidate`
    double high[BATCH + LANES]


# ---- the event queue ----

cdef struct Queue:  # a tournament of the discs' next events; level 0 has one time a disc, the top level the least of all
    double *time
    int *holder  # the disc to which each time belongs, in the same places; from level 1 on
    Index level[LEVELS]  # where each level begins in `time` and `holder`
    Index top  # number of the top level
    Index discs


# ---- the run ----

cdef struct Clock:  # a time since the start is epoch + (epoch_rest + time)
    double now  # of the last impact
    double epoch
    double epoch_rest
    double reported  # time of the last impact since the start, never less than the one before

cdef struct Counts:
    Index impacts  # since the start
    Index wall_impacts
    Index predictions  # of discs after impacts
    Index stale
    Index crossings
    Index beyond  # times that all features were looked at, for a disc beyond the area of the lists
    Index choices  # of cells since the start, those for where the discs began not counted
    Index epochs  # begun anew
    Index epoch_impacts  # in this epoch
    Index at_instant  # impacts since time last advanced
    Index predicted  # discs that have been predicted since the epoch began
    Index too_far  # impacts of discs so far out that floats do not tell their centres apart: a run with one is refused

cdef struct State:  # all that a run consists of
    Disc *discs
    Prediction *predictions
    Wall *walls  # the obstacles, where all are half-planes with the coefficients of `law`: then there are no features
    Feature *features  # the obstacles elsewhere: of each wall in turn its features in their order, a half-plane as one
    Law *wall_laws  # where there are features, the law on each wall
    double *last_impact  # time of each disc's, for the TC model alone
    Turning *turning  # of each disc; NULL if no disc spins
    Index disc_count
    Index wall_count
    Index feature_count
    Index gliding  # where a run has ended in `GLIDES`, the disc that does
    Index standstill  # impacts at one instant from which on time no longer advances
    bint looks_ahead  # whether memory is fetched before it is needed
    bint looks_apart  # whether there are features, or something is driven: some of what comes next is predicted elsewhere
    bint is_special  # whether something turns or is driven, or there are features: impacts are carried out away from the loop
    Clock clock
    Law law
    Counts counts
    Grid grid
    Queue queue
    Candidates candidates
    Record record
    Box visited  # where the discs began, and have struck features: their paths turn there
    Driving driving
    ToAndFro *to_and_fro  # of each disc; NULL if no body is driven
    Crushes crushes
    void *asked
    Ending stopped  # where an impact has ended the run, how
