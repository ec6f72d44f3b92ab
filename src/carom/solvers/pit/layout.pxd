"""What the compiled frame loop of PIT keeps, and in which words: to be read before its other rooms.

Units are metres, metres a second and kilograms; times are seconds since the start. Walls, spins, the law and recorded
impacts are those of every solver: `impact/structs.pxd`.
"""

from carom.solvers.impact.structs cimport Index, Law, Record, Turning, Wall
from carom.solvers.pit.stretches cimport Finite

cdef enum:
    NOWHERE = -1  # in no cell yet
    ON_WALL = -2  # less the number of the wall: the one that a disc met last
    MOST_LEVELS = 16  # of cells: the smallest discs on the last one are 2^-16 of the largest, and smaller
    MOST_STEPS = 512  # that the discs are taken in one go: 4 KiB of lengths


# ---- discs ----

cdef struct Disc:  # 64 bytes, one cache line: all that a disc's neighbours look at
    double x  # centre at `State.now`
    double y
    double vx  # velocity
    double vy
    double radius
    double inverse_mass  # 0: it never moves
    int next  # the disc that follows in its cell's chain, or NOBODY
    int cell  # number of the chain that it is in, or NOWHERE
    int level  # of cells that it is kept on: the larger a disc, the lower
    int last  # the body that it met last: a disc, `ON_WALL - k` for wall k, or NOBODY


cdef struct Normal:  # of the finite wall that a disc met last
    double x
    double y


# ---- cells ----

cdef struct Level:  # square cells for discs of about one size
    double width  # of a cell
    double leeway  # how far a disc may be from where it was when it was put into its cell
    double reach  # the largest radius on this level, and the leeway

cdef struct Grid:
    int *first  # of each chain: a disc, or NOBODY. Cells without number share these chains.
    Index chains  # a power of 2; 0 where there are so few discs that all are near each other
    Index level_count
    Level levels[MOST_LEVELS]


# ---- the tests of one frame ----

ctypedef unsigned long long Test  # a pair's or a wall's place in the order of Algorithm 1, see pending.pxd

cdef struct Pending:  # tests that are still to be made at this frame: a binary heap, the next one on top
    Test *heap
    Index count
    Index capacity
    Test last  # the last one that was made at this frame, or NO_TEST


# ---- the run ----

cdef struct Clock:  # frame k stands at k * step / rate, and one of the two is 1: neither form adds a rounding
    double step  # seconds
    double rate  # frames a second

cdef struct Counts:
    Index frames  # passed: those before this number
    Index looked_at  # frames at which anything was tested
    Index pair_tests

cdef struct State:  # all that a run consists of
    Disc *discs
    Wall *walls  # of a finite one, its normal where a disc has just met it
    Law *wall_laws  # the law on each wall
    Finite *finite  # one a wall; NULL where all are half-planes
    Normal *normals  # one a disc, where there are finite walls
    Turning *turning  # of each disc; NULL if no disc spins
    double *due  # before which time no impact of a disc can be due; INF for one that never moves
    int *looking  # discs that are due at this frame
    Index disc_count
    Index wall_count
    double now  # the frame that was passed last
    double next_look  # before which no disc is due
    double horizon  # for how long a bound holds at most, seconds: `MOST_FRAMES` of bounds.pxd
    bint falls  # whether there is gravity
    double gx  # gravity
    double gy
    bint skips  # whether tests that can find nothing are left out; those bounds are of straight paths
    Index row  # plain looping: the disc whose tests come next at this frame; 0 between frames
    double excess  # work of skipping beyond that of plain looping
    double first_look  # work of looking around all discs once
    double most_waste  # how many times that much may be in excess
    bint pays_back  # loops plainly, since there was more
    double work  # that is left until a pause; all work is counted in tests of two discs by plain looping
    bint no_memory  # was found where it was needed
    bint too_far  # discs met so far out that floats do not tell their centres apart
    Law law
    Clock clock
    Counts counts
    Grid grid
    Pending pending
    Record record
    double steps[MOST_STEPS]  # lengths of the steps to the next frames
