"""Inlined functions of the core, callable by tests.

The module is built with the extension if that is built in place, see setup.py. No wheel contains this module.
"""

from carom.core.carom_core cimport Corners, Index, Law, Recent, Resize, Spins, Turning, c_bool
from carom.core.run_input cimport law_of
from carom.core.formulas cimport DoubleDouble, Frictions, Slips, descent_time as c_descent_time, greater

from libc.stdlib cimport free

import numpy as np

cdef extern from "float.h":
    int FLT_EVAL_METHOD

cdef extern from "carom/core/carom_core.h" nogil:
    enum:
        NOBODY
        NO_FEATURE

    struct Wall:
        double x
        double y
        double nx
        double ny

    struct Surface:
        double vx
        double vy
        double belt

    struct Body:
        double *velocity
        double inverse_mass
        double radius
        Turning *turning

cdef extern from "carom/core/binding_memory.h":
    void *carom_enlarge(void *memory, size_t used, size_t size) noexcept nogil

cdef extern from "carom/core/arithmetic/double_double.h" nogil:
    struct TripleDouble:
        pass

    DoubleDouble c_two_sum "two_sum"(double a, double b)
    DoubleDouble c_two_prod "two_prod"(double a, double b)
    TripleDouble empty_sum()
    TripleDouble add_product(TripleDouble total, double a, double b)
    DoubleDouble round_sum(TripleDouble total)

cdef extern from "carom/core/arithmetic/exponentials.h" nogil:
    double nearest_exp(double x)
    double nearest_expm1(double x)
    struct LogAnchor:
        pass

    LogAnchor first_anchor()
    double nearest_log1p_from(LogAnchor *anchor, double x)

cdef extern from "carom/core/straight/pair_time.h" nogil:
    struct Encounter:
        pass

    Encounter encounter(
        double x1, double y1, double vx1, double vy1, double r1,
        double x2, double y2, double vx2, double vy2, double r2,
    )
    double exact_pair_time(Encounter e)

cdef extern from "carom/core/wall_contact_law.h" nogil:
    struct Press:
        double normal
        double along
        double friction
        double inverse_inertia_ratio
        double rolling_resistance

    Frictions c_share_frictions "share_frictions"(
        double s1, double q1, double f_most, double h_most, double y, Slips signs
    )
    double c_slip_after_bounces "slip_after_bounces"(
        const Press *press, double slip, double approach, double restitution
    )

cdef extern from "carom/core/impact_law.h" nogil:
    double collide_discs(
        const Law *law, double dx, double dy, Body *a, Body *b, c_bool elastic, c_bool has_spins, Spins *spins
    )
    double collide_wall(
        const Law *law, const Wall *wall, const Surface *surface, Body *a, c_bool elastic, c_bool has_spins, Spins *spins
    )

cdef extern from "carom/core/impact_record.h" nogil:
    void clear_recent(Recent *recent)
    bint add_contact(
        Recent *recent, double time, double resolution, double nx, double ny, int feature, bint elastic,
        const Corners *corners,
    )
    double pair_resolution(double sizes, double reach, double ux, double uy, double speed)
    double wall_resolution(double sizes, double speed)
    double clock_resolution(double time)

cdef extern from "carom/core/pic/state.h" nogil:
    enum:
        NO_OBSTACLE
        PLACES

    struct Disc:
        double radius

    struct Prediction:
        pass

    struct Cell:
        int disc[2]

    struct Box:
        pass

    struct Grid:
        Cell *cells
        int *chain
        unsigned int *list_of
        int *lists
        double extent
        double x0
        double y0
        double width
        Index columns
        Index rows
        Index stride

    struct Block:
        pass

    struct Candidates:
        int *disc

    struct Queue:
        double *time
        int *holder

    struct State:
        Disc *discs
        Prediction *predictions
        Wall *walls
        Index disc_count
        Index wall_count
        Grid grid
        Candidates candidates
        Box visited
        Resize resize

cdef extern from "carom/core/pic/event_queue.h" nogil:
    bint lay_out_queue(Queue *q, Index discs)
    Index queue_length(const Queue *q)
    void set_time(Queue *q, Index i, double time)
    Index earliest(const Queue *q)
    double earliest_except(const Queue *q, Index i, Index j)
    Index next_not_after(const Queue *q, Index i, double time)

cdef extern from "carom/core/pic/grid.h" nogil:
    void set_sizes(Grid *g, const double *radius, Index discs, double factor)
    Box box_around(const double *position, Index discs)
    double wall_extent(const Wall *w)
    void choose_grid(Grid *g, const Box *box, Index discs, Index feature_count)
    Index cell_count(const Grid *g)
    Index tile_count(const Grid *g)
    Index tile_of(const Grid *g, Index row, Index column)
    void add_to_cell(State *s, Index i, Index row, Index column)
    void remove_from_cell(State *s, Index i, Index row, Index column)

cdef extern from "carom/core/pic/obstacle_lists.h" nogil:
    bint list_obstacles(State *s)

cdef extern from "carom/core/pic/straight_partner.h" nogil:
    struct Chains:
        Index left

    Index gather_discs(State *s, Block block, Chains *chains)
    Index gather_chained_discs(State *s, Block block, Chains *chains, Index count)

cdef extern from *:
    """
    #include <stddef.h>

    /* Return a cell and its neighbours, as `cells_around` does for a disc in it. */
    static Block carom_block(const Grid *g, Index row, Index column) {
        return (Block){(row - 1) * g->stride + column - 1, 3, g->stride, 1};
    }

    /* Fields of structs that are rows of arrays, with the places that the C compiler gives them. */
    #define FIELD(row, field) {                                                                               \
        #row, #field, offsetof(row, field), sizeof(((row *)0)->field), sizeof(row),                           \
        _Generic(((row *)0)->field, double: "f8", double *: "f8", int64_t: "i8", int: "i4", int *: "i4",      \
                 short: "i2", signed char: "i1")                                                              \
    }
    static const struct CaromField {
        const char *row;
        const char *name;
        size_t place;
        size_t size;
        size_t row_size;
        const char *type;
    } carom_fields[] = {
        FIELD(Disc, x), FIELD(Disc, y), FIELD(Disc, vx), FIELD(Disc, vy), FIELD(Disc, time), FIELD(Disc, radius),
        FIELD(Disc, inverse_mass), FIELD(Disc, impacts), FIELD(Disc, last),
        FIELD(Prediction, impact_time), FIELD(Prediction, exit_time), FIELD(Prediction, partner),
        FIELD(Prediction, partner_impacts), FIELD(Prediction, cell),
        FIELD(Cell, disc),
        FIELD(Impact, time), FIELD(Impact, first), FIELD(Impact, second), FIELD(Impact, normal),
        FIELD(Impact, first_before), FIELD(Impact, second_before), FIELD(Impact, first_after),
        FIELD(Impact, second_after),
        FIELD(Spins, first_before), FIELD(Spins, second_before), FIELD(Spins, first_after), FIELD(Spins, second_after),
        FIELD(Contact, x), FIELD(Contact, y), FIELD(Contact, feature),
    };
    enum { CAROM_FIELDS = sizeof(carom_fields) / sizeof(carom_fields[0]) };
    """
    struct CaromField:
        const char *row
        const char *name
        size_t place
        size_t size
        size_t row_size
        const char *type

    const CaromField carom_fields[1]
    enum:
        CAROM_FIELDS

    Block carom_block(const Grid *g, Index row, Index column) nogil

#: 0 if every operation is rounded to its own type, as IEEE 754 requires.
EVALUATION_METHOD = FLT_EVAL_METHOD


def two_sum(double a, double b):
    s = c_two_sum(a, b)
    return s.high, s.low


def two_prod(double a, double b):
    p = c_two_prod(a, b)
    return p.high, p.low


def exp(double x):
    return nearest_exp(x)


def expm1(double x):
    return nearest_expm1(x)


def logs1p(numbers):
    """Return the logarithm of 1 + x for each number x, computed one from another."""
    cdef LogAnchor anchor = first_anchor()
    return [nearest_log1p_from(&anchor, x) for x in numbers]


def sum_of_products(factors):
    """Return the sum of products of two numbers as a pair."""
    total = empty_sum()
    for a, b in factors:
        total = add_product(total, a, b)
    s = round_sum(total)
    return s.high, s.low


def exact_time(
    double x1, double y1, double vx1, double vy1, double r1, double x2, double y2, double vx2, double vy2, double r2
):
    """Return the time of impact by the error-free form alone."""
    return exact_pair_time(encounter(x1, y1, vx1, vy1, r1, x2, y2, vx2, vy2, r2))


def descent_time(gap, speed, pull):
    """Return when a gap closes; the gap, its rate of change and its acceleration are pairs."""
    return c_descent_time(
        DoubleDouble(gap[0], gap[1]), DoubleDouble(speed[0], speed[1]), DoubleDouble(pull[0], pull[1])
    )


def share_frictions(double s1, double q1, most, double y, signs):
    """Return the two frictions by name: `Frictions` in wall_contact_law.h."""
    cdef double f_most, h_most, slip, rim
    f_most, h_most = most
    slip, rim = signs
    return c_share_frictions(s1, q1, f_most, h_most, y, Slips(slip, rim))


cdef Press press_from(press):
    return Press(press[0], press[1], press[2], press[3], press[4])


def slip_after_bounces(press, double slip, double approach, double restitution):
    cdef Press pressed = press_from(press)
    return c_slip_after_bounces(&pressed, slip, approach, restitution)


def collide(start, wall=None):
    """Return velocities and spins of the discs of a start after the first disc has hit the second, or a half-plane.

    The present positions give the normal. The law is that of the start, `carom.model.disc_arrays.DiscArrays`.
    """
    cdef Law law = law_of(start, 0.0)
    cdef double[:, ::1] velocity = start.velocity_m_s.copy()
    cdef double[::1] spins = start.spins.copy()
    cdef Turning first = Turning(spins[0], 1.0 / <double> start.inertia[0])
    cdef Turning second = Turning(spins[1], 1.0 / <double> start.inertia[1])
    cdef Body one = Body(&velocity[0, 0], 1.0 / <double> start.mass_kg[0], start.radius_m[0], &first)
    cdef Body other = Body(&velocity[1, 0], 1.0 / <double> start.mass_kg[1], start.radius_m[1], &second)
    cdef Spins recorded
    cdef Wall plane
    dx, dy = start.position_m[1] - start.position_m[0]
    if wall is None:
        collide_discs(&law, dx, dy, &one, &other, False, True, &recorded)
    else:
        plane = Wall(wall[0], wall[1], wall[2], wall[3])
        collide_wall(&law, &plane, NULL, &one, False, True, &recorded)
    return np.asarray(velocity), np.array([first.spin, second.spin])


def layouts():
    """Return the dtypes of structs that are rows of arrays, by name, with the layout of the C compiler."""
    rows = {}
    for k in range(CAROM_FIELDS):
        field = &carom_fields[k]
        row = rows.setdefault(field.row.decode(), dict(names=[], formats=[], offsets=[], itemsize=field.row_size))
        base = np.dtype(field.type.decode())
        row["names"].append(field.name.decode())
        row["formats"].append(base if field.size == base.itemsize else (base, field.size // base.itemsize))
        row["offsets"].append(field.place)
    return {name: np.dtype(row) for name, row in rows.items()}


def resolutions(double sizes, double reach, double ux, double uy, double speed, double time):
    """Return the resolutions of an impact of two discs, of one on a wall, and of the clock."""
    return pair_resolution(sizes, reach, ux, uy, speed), wall_resolution(sizes, speed), clock_resolution(time)


def ambiguous(impacts):
    """Return which of a disc's impacts, ``(time, resolution, nx, ny)`` each, are ambiguous."""
    cdef Recent recent
    cdef Corners none
    clear_recent(&recent)
    return [
        add_contact(&recent, time, resolution, nx, ny, NO_FEATURE, False, &none) for time, resolution, nx, ny in impacts
    ]


cdef class EventQueue:
    """An event queue."""

    cdef Queue q
    cdef double[::1] time
    cdef int[::1] holder

    def __cinit__(self, Index discs):
        if not lay_out_queue(&self.q, discs):
            raise ValueError("more discs than an event queue can hold")
        cdef Index length = queue_length(&self.q)
        self.time = np.full(length, np.inf)
        self.holder = np.zeros(length, np.int32)
        self.q.time = &self.time[0]
        self.q.holder = &self.holder[0]

    def set_time(self, Index i, double time):
        set_time(&self.q, i, time)

    def earliest(self):
        return earliest(&self.q)

    def earliest_except(self, Index i, Index j):
        return earliest_except(&self.q, i, j)

    def next_not_after(self, Index i, double time):
        return next_not_after(&self.q, i, time)


cdef class Cells:
    """The cells of a run, without discs."""

    cdef State s
    cdef int[::1] cells, chain
    cdef unsigned int[::1] list_of
    cdef object memory

    def __cinit__(self, const double[:, ::1] position, const double[::1] radius, const double[:, ::1] walls):
        s = &self.s
        cdef Index n = radius.shape[0]
        cdef Index k
        s.disc_count, s.wall_count, s.walls, s.resize = n, walls.shape[0], <Wall *>&walls[0, 0], carom_enlarge
        for k in range(s.wall_count):
            s.grid.extent = greater(s.grid.extent, wall_extent(&s.walls[k]))
        s.visited = box_around(&position[0, 0], n)
        set_sizes(&s.grid, &radius[0], n, 1.0)
        choose_grid(&s.grid, &s.visited, n, 0)
        cdef char[::1] discs = np.zeros(n * sizeof(Disc), np.int8)
        cdef char[::1] predictions = np.zeros(n * sizeof(Prediction), np.int8)
        s.discs, s.predictions = <Disc *>&discs[0], <Prediction *>&predictions[0]
        for k in range(n):
            s.discs[k].radius = radius[k]
        self.memory = discs, predictions, walls
        self.cells = np.full(cell_count(&s.grid) * PLACES, NOBODY, np.int32)
        self.chain = np.zeros(n, np.int32)
        self.list_of = np.zeros(tile_count(&s.grid), np.uint32)
        s.grid.cells, s.grid.chain, s.grid.list_of = <Cell *>&self.cells[0], &self.chain[0], &self.list_of[0]
        if not list_obstacles(s):
            raise MemoryError

    def __dealloc__(self):
        free(self.s.grid.lists)

    def add(self, Index i, Index row, Index column):
        add_to_cell(&self.s, i, row, column)

    def remove(self, Index i, Index row, Index column):
        remove_from_cell(&self.s, i, row, column)

    def around(self, Index row, Index column):
        """Return the discs of a cell and its eight neighbours, in the batches of a scan."""
        s = &self.s
        cdef Chains chains
        cdef Block block = carom_block(&s.grid, row, column)
        cdef Index count = gather_discs(s, block, &chains)
        batches = []
        while True:
            count = gather_chained_discs(s, block, &chains, count)
            batches.append([s.candidates.disc[k] for k in range(count)])
            if chains.left == 0:
                return batches
            count = 0

    @property
    def grid(self):
        """Lower left corner, width of a cell, and numbers of columns and rows."""
        return self.s.grid.x0, self.s.grid.y0, self.s.grid.width, self.s.grid.columns, self.s.grid.rows

    def walls_near(self, Index row, Index column):
        """Return the numbers of walls that a disc in a cell may hit, from the list of its tile. The ring is row 0."""
        numbers = self.s.grid.lists + (self.list_of[tile_of(&self.s.grid, row, column)] >> 1)
        found = []
        while numbers[0] != NO_OBSTACLE:
            found.append(numbers[0])
            numbers += 1
        return found
