"""What is inlined wherever it runs, one function at a time, for tests: nothing else can call it.

Built with the extension where that is built in place, see setup.py; it is in no wheel.
"""

from carom.constants cimport INF
from carom.physics cimport double_double, wall_time as wall
from carom.physics.feature_time cimport feature_time as compiled_feature_time, normal_at as compiled_normal_at
from carom.physics.double_double cimport DoubleDouble
from carom.physics.features cimport FEATURE_NUMBERS, Mover, feature_from
from carom.physics.pair_time cimport encounter, exact_pair_time
from carom.physics.pair_time cimport pair_time as compiled_pair_time
from carom.solvers.event_driven.grid cimport box_of, cell_count, choose_grid, note_sizes, put, take, tile_count, tile_of
from carom.solvers.event_driven.layout cimport (
    NO_OBSTACLE, NOBODY, PLACES, Block, Cell, Disc, Index, Prediction, Queue, State, Wall,
)
from carom.solvers.event_driven.obstacles cimport find_obstacles
from carom.solvers.event_driven.queue cimport earliest, earliest_but, lay_out_queue, next_at, set_time
from carom.solvers.event_driven.scan cimport Chains, gather, gather_chained
from carom.solvers.impact cimport law
from carom.solvers.impact.ambiguity cimport add_contact, forget
from carom.solvers.impact.structs cimport NO_FEATURE, Contact, ContactFriction, Corners, Impact, Recent, Spins
from carom.solvers.impact.resolution cimport clock_resolution, pair_resolution, wall_resolution

from libc.stdlib cimport free

import numpy as np

cdef extern from "float.h":
    int FLT_EVAL_METHOD

#: 0 where every operation is rounded to its own type, as IEEE 754 demands.
EVALUATION_METHOD = FLT_EVAL_METHOD


def two_sum(double a, double b):
    s = double_double.two_sum(a, b)
    return s.high, s.low


def two_diff(double a, double b):
    s = double_double.two_diff(a, b)
    return s.high, s.low


def two_prod(double a, double b):
    p = double_double.two_prod(a, b)
    return p.high, p.low


def pair_time(
    double x1, double y1, double vx1, double vy1, double r1, double x2, double y2, double vx2, double vy2, double r2
):
    return compiled_pair_time(x1, y1, vx1, vy1, r1, x2, y2, vx2, vy2, r2)


def exact_time(
    double x1, double y1, double vx1, double vy1, double r1, double x2, double y2, double vx2, double vy2, double r2
):
    """Return the time of impact by the error-free form alone."""
    return exact_pair_time(encounter(x1, y1, vx1, vy1, r1, x2, y2, vx2, vy2, r2))


def wall_time(double x, double y, double vx, double vy, double radius, double qx, double qy, double nx, double ny):
    return wall.wall_time(x, y, vx, vy, radius, qx, qy, nx, ny)


cdef Mover mover_of(disc):
    (x, xl), (y, yl), (ux, uxl), (uy, uyl), radius = disc
    return Mover(DoubleDouble(x, xl), DoubleDouble(y, yl), DoubleDouble(ux, uxl), DoubleDouble(uy, uyl), radius)


def feature_time(const double[::1] numbers, disc, bint just_left):
    """Return when a disc touches a feature, given by its numbers, and whether it glides there."""
    if numbers.shape[0] != FEATURE_NUMBERS:
        raise ValueError("not the numbers of a feature")
    feature = feature_from(&numbers[0])
    mover = mover_of(disc)
    touch = compiled_feature_time(&mover, &feature, just_left)
    return touch.time, touch.glides


def normal_at(const double[::1] numbers, disc):
    """Return the unit vector from a feature to a disc."""
    feature = feature_from(&numbers[0])
    mover = mover_of(disc)
    normal = compiled_normal_at(&feature, &mover)
    return normal.x, normal.y


def pair_normal_impulse(double dx, double dy, double ux, double uy, double inverse_masses, double restitution):
    return law.normal_impulse(dx, dy, ux, uy, inverse_masses, restitution)


def pair_tangential_impulse(
    contact, double dx, double dy, double ux, double uy, double surface, double inverse_effective_mass, double normal
):
    cdef ContactFriction friction = ContactFriction(contact[0], contact[1])
    return law.pair_tangential_impulse(&friction, dx, dy, ux, uy, surface, inverse_effective_mass, normal)


def layouts():
    """Return the dtypes of the structs that are rows: as the C compiler has laid them out."""
    cdef Disc disc
    cdef Prediction prediction
    cdef Cell cell
    cdef Impact impact
    cdef Spins spins
    cdef Contact contact
    return {
        "Disc": np.asarray(<Disc[:1]>&disc).dtype,
        "Prediction": np.asarray(<Prediction[:1]>&prediction).dtype,
        "Cell": np.asarray(<Cell[:1]>&cell).dtype,
        "Impact": np.asarray(<Impact[:1]>&impact).dtype,
        "Spins": np.asarray(<Spins[:1]>&spins).dtype,
        "Contact": np.asarray(<Contact[:1]>&contact).dtype,
    }


def resolutions(double sizes, double reach, double ux, double uy, double speed, double time):
    """Return the resolutions of an impact of two discs, of one on a wall, and of the clock."""
    return pair_resolution(sizes, reach, ux, uy, speed), wall_resolution(sizes, speed), clock_resolution(time)


def ambiguous(impacts):
    """Return which of a disc's impacts, ``(time, resolution, nx, ny)`` each, are ambiguous."""
    cdef Recent recent
    cdef Corners none
    forget(&recent)
    return [
        add_contact(&recent, time, resolution, nx, ny, NO_FEATURE, False, &none) for time, resolution, nx, ny in impacts
    ]


cdef class EventQueue:
    """An event queue."""

    cdef Queue q
    cdef double[::1] time
    cdef int[::1] holder

    def __cinit__(self, Index discs):
        cdef Index length = lay_out_queue(&self.q, discs)
        self.time = np.full(length, np.inf)
        self.holder = np.zeros(length, np.int32)
        self.q.time = &self.time[0]
        self.q.holder = &self.holder[0]

    def set_time(self, Index i, double time):
        set_time(&self.q, i, time)

    def earliest(self):
        return earliest(&self.q)

    def earliest_but(self, Index i, Index j):
        return earliest_but(&self.q, i, j)

    def next_at(self, Index i, double time):
        return next_at(&self.q, i, time)


cdef class Cells:
    """The cells of a run, with no disc in them yet."""

    cdef State s
    cdef Prediction[::1] predictions
    cdef int[::1] cells, chain
    cdef unsigned int[::1] list_of
    cdef object kept

    def __cinit__(self, double[:, ::1] position, double[::1] radius, double[:, ::1] walls):
        s = &self.s
        cdef Index n = radius.shape[0]
        s.disc_count, s.wall_count = n, walls.shape[0]
        s.visited = box_of(&position[0, 0], n)
        note_sizes(&s.grid, &radius[0], n, 1.0)
        choose_grid(&s.grid, &s.visited, n, <Wall *>&walls[0, 0], s.wall_count, NULL, 0)
        cdef Disc[::1] discs = np.zeros(n, layouts()["Disc"])
        for i in range(n):
            discs[i].radius = radius[i]
        self.kept = discs, walls
        self.predictions = np.zeros(n, layouts()["Prediction"])
        self.cells = np.full(cell_count(&s.grid) * PLACES, NOBODY, np.int32)
        self.chain = np.zeros(n, np.int32)
        self.list_of = np.zeros(tile_count(&s.grid), np.uint32)
        s.discs, s.walls, s.predictions = &discs[0], <Wall *>&walls[0, 0], &self.predictions[0]
        s.grid.cells, s.grid.chain, s.grid.list_of = <Cell *>&self.cells[0], &self.chain[0], &self.list_of[0]
        find_obstacles(s)

    def __dealloc__(self):
        free(self.s.grid.lists)

    def put(self, Index i, Index row, Index column):
        put(&self.s, i, row, column)

    def take(self, Index i, Index row, Index column):
        take(&self.s, i, row, column)

    def around(self, Index row, Index column):
        """Return the discs of a cell and of its eight neighbours, in the batches in which a scan finds them."""
        s = &self.s
        cdef Chains chains
        cdef Block block = Block((row - 1) * s.grid.stride + column - 1, 3, s.grid.stride, 1)
        batches = [[s.candidates.disc[k] for k in range(gather(s, block, &chains))]]
        while chains.left > 0:
            batches.append([s.candidates.disc[k] for k in range(gather_chained(s, block, &chains))])
        return batches

    @property
    def grid(self):
        """Lower left corner, width of a cell, numbers of columns and rows."""
        return self.s.grid.x0, self.s.grid.y0, self.s.grid.width, self.s.grid.columns, self.s.grid.rows

    def walls_near(self, Index row, Index column):
        """Return the numbers of the walls that a disc in a cell may meet, as the cell knows them; the ring is row 0."""
        numbers = self.s.grid.lists + (self.list_of[tile_of(&self.s.grid, row, column)] >> 1)
        found = []
        while numbers[0] != NO_OBSTACLE:
            found.append(numbers[0])
            numbers += 1
        return found
