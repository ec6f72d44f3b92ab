"""Proven lower bounds of times of impact, as 64-bit floats, which make most interval arithmetic unnecessary.

`docs/theory/certified.md` derives the bounds and their margins for rounding. Numbers are scaled by powers of two, which
causes no rounding: see `carom.solvers.units`. If a number is too large or too small to compute a bound, the bound is
the start of the later of the two bodies' paths, and interval arithmetic computes the time.

With gravity, states are relative to a freely falling reference frame, in which falling discs move along straight lines.
The start of the later path is also the bound for bodies that do not fall, for driven walls, and for driven discs that
change direction.
"""

from libc.math cimport fabs, ldexp, sqrt
from libc.stdlib cimport calloc, free

from carom.core.formulas cimport greater

from math import frexp

from flint import arb

from carom.core.wall_parts import Round
from carom.solvers.certified.ball_arithmetic import float_above
from carom.solvers.units import choose_units
from carom.model.trace import wall_body, wall_index

cdef extern from "carom/core/constants.h" nogil:
    const double FASTEST "CAROM_FASTEST"
    const double FLOOR "CAROM_FLOOR"
    const double INF "CAROM_INF"
    const double NORMAL "CAROM_NORMAL"
    const double ROUNDOFF "CAROM_ROUNDOFF"
    const double TINY "CAROM_TINY"
    const double WIDER "CAROM_WIDER"

cdef enum:
    NOBODY = -1
    SHARP_BITS = 54  # an interval with this many accurate bits is narrower than the rounding error of a float

cdef enum Form:
    FLAT  # a half-plane or a face
    ROUND  # a vertex or the outside of an arc
    HOLLOW  # the inside of an arc, or a moving wall: no bounds are computed

cdef struct Path:  # a disc on its present path, in scaled float64 numbers
    double time  # exact time in seconds at which the disc is at (x, y), perhaps on its path extended backwards
    double x
    double y
    double vx
    double vy
    double error  # bound of the error of x and y, including rounding
    double error_v  # bound of the error of vx and vy, including rounding
    double radius
    double rim  # the radius, rounded up
    Py_ssize_t met  # column of the body that the disc has just met, and can't meet again on this path; or NOBODY
    bint immovable
    bint bends  # whether the path is not straight; if so, no bounds are computed

cdef struct Wall:  # a part of a wall that a disc can meet
    Form form
    Path round  # the vertex or arc as a disc of the same radius
    double nx  # the half-plane is n.p >= level, in scaled numbers; the normal n has any length
    double ny
    double level  # rounded up, so that the rounding error of subtracting the level is included
    double length  # length of n, rounded up
    double span  # |nx| + |ny|

cdef struct Least:  # the smallest bound in a row of the table
    double bound
    Py_ssize_t column

cdef struct Table:  # bounds for each disc (row) with each disc and each wall (columns)
    Path *paths
    Wall *walls
    double *bounds  # row by row; a pair's bound is in the row of the disc that changed last, and INF in the other row
    Least *least  # smallest bound of each row
    Py_ssize_t discs
    Py_ssize_t width  # number of columns
    double unit  # one second in scaled units of time
    double second  # one scaled unit of time in seconds
    bint falls  # whether there is gravity


cdef inline double bound_after(double start, double wait, double second) noexcept nogil:
    """Return a lower bound, in seconds, of `start` plus a scaled wait; `start` if the wait is not a normal float."""
    wait *= 1.0 - 16.0 * ROUNDOFF
    if not (wait >= NORMAL and wait < INF):
        return start
    wait *= second
    if not wait >= NORMAL:
        return start
    return greater(start, (start + wait) * (1.0 - 4.0 * ROUNDOFF))


cdef inline double pair_bound(const Path *p, const Path *q, const Table *table) noexcept nogil:
    """Return a lower bound of the time at which two discs meet, in seconds."""
    start = greater(p.time, q.time)
    if p.bends or q.bends:
        return start
    wait_p = (start - p.time) * table.unit
    wait_q = (start - q.time) * table.unit
    dx = (q.x + q.vx * wait_q) - (p.x + p.vx * wait_p)
    dy = (q.y + q.vy * wait_q) - (p.y + p.vy * wait_p)
    ux = q.vx - p.vx
    uy = q.vy - p.vy
    e = ((q.error + q.error_v * wait_q) + (p.error + p.error_v * wait_p)) * WIDER
    f = (q.error_v + p.error_v) * WIDER
    d1 = fabs(dx) + fabs(dy)
    u1 = fabs(ux) + fabs(uy)
    b = e * u1 + f * (d1 + 2.0 * e) - (dx * ux + dy * uy)
    if b <= 0.0 and b > -INF:
        return INF
    reach = q.radius + p.radius
    c = dx * dx + dy * dy - reach * reach - 2.0 * e * (d1 + e)
    a = greater(ux * ux + uy * uy - 2.0 * f * (u1 + f), 0.0)
    size = b * b + fabs(a * c)
    if not size < INF:
        return start
    root = b * b - a * c + (8.0 * ROUNDOFF * size + FLOOR)
    if root < 0.0:
        return INF
    return bound_after(start, greater(c, 0.0) / (b + sqrt(root)), table.second)


cdef inline double wall_bound(const Path *p, const Wall *wall, const Table *table) noexcept nogil:
    """Return a lower bound of the time at which a disc meets a wall, in seconds."""
    if table.falls or p.bends or wall.form == HOLLOW:
        return p.time
    if wall.form == ROUND:
        return pair_bound(p, &wall.round, table)
    toward = p.error_v * WIDER * wall.span - (p.vx * wall.nx + p.vy * wall.ny)
    if toward <= 0.0 and toward > -INF:
        return INF
    gap = p.x * wall.nx + p.y * wall.ny - wall.level - p.rim * wall.length - p.error * WIDER * wall.span
    return bound_after(p.time, greater(gap, 0.0) / toward, table.second)


cdef void find_least(Table *table, Py_ssize_t i) noexcept nogil:
    """Find the smallest bound of row `i`. Among equal bounds, the first is used."""
    row = &table.bounds[i * table.width]
    cdef Least least = Least(INF, 0)
    cdef Py_ssize_t k
    for k in range(table.width):
        if row[k] < least.bound:
            least = Least(row[k], k)
    table.least[i] = least


cdef void fill_row(Table *table, Py_ssize_t i, Py_ssize_t begin) noexcept nogil:
    """Compute the bounds of disc `i` with all discs from `begin` on, and with all walls."""
    p = &table.paths[i]
    row = &table.bounds[i * table.width]
    cdef Py_ssize_t k
    for k in range(table.discs):
        q = &table.paths[k]
        if k < begin or k == i or k == p.met or (p.immovable and (q.immovable or i == q.met)):
            row[k] = INF
        else:
            row[k] = pair_bound(p, q, table)
    for k in range(table.discs, table.width):
        row[k] = INF if k == p.met or p.immovable else wall_bound(p, &table.walls[k - table.discs], table)
    find_least(table, i)


cdef void renew(Table *table, Py_ssize_t i, Py_ssize_t j) noexcept nogil:
    """Recompute all bounds of discs `i` and `j` after their states have changed. `j` equals `i` for a single disc."""
    cdef Py_ssize_t k
    for k in range(table.discs):
        table.bounds[k * table.width + i] = table.bounds[k * table.width + j] = INF
    fill_row(table, i, 0)
    if j != i:
        fill_row(table, j, 0)
        table.bounds[j * table.width + i] = INF
    for k in range(table.discs):
        if table.least[k].column == i or table.least[k].column == j:
            find_least(table, k)


cdef class LowerBounds:
    """Lower bounds of the time of impact for each pair of discs, and for each disc and wall, in seconds.

    A pair is identified by the number of a disc, which is the row, and the body number of the other disc or wall.
    The method `changed` reads the states from `bodies` again.
    """

    cdef Table table
    cdef object bodies
    cdef int length  # lengths are scaled by 2^-length
    cdef int speed  # speeds are scaled by 2^-speed

    def __init__(self, bodies):
        table = &self.table
        cdef Py_ssize_t row
        scene = bodies.scene
        units = choose_units(scene)
        self.bodies = bodies
        self.length, self.speed = units.length, units.length - units.time
        table.unit, table.second = ldexp(1.0, -units.time), ldexp(1.0, units.time)
        table.discs = len(scene.discs)
        table.width = table.discs + len(bodies.obstacles)
        table.falls = bodies.falls
        table.paths = <Path *>calloc(table.discs, sizeof(Path))
        table.walls = <Wall *>calloc(table.width - table.discs + 1, sizeof(Wall))
        table.bounds = <double *>calloc(table.discs * table.width, sizeof(double))
        table.least = <Least *>calloc(table.discs, sizeof(Least))
        if table.paths == NULL or table.walls == NULL or table.bounds == NULL or table.least == NULL:
            raise MemoryError(f"no memory for the bounds of {table.discs} x {table.width} pairs")
        for k in range(table.width - table.discs):
            self._load_wall(k)
        for row in range(table.discs):
            self._load(row)
        with nogil:
            for row in range(table.discs):
                fill_row(table, row, row)

    def __dealloc__(self):
        free(self.table.paths)
        free(self.table.walls)
        free(self.table.bounds)
        free(self.table.least)

    def changed(self, *discs):
        """Reload the state of one movable disc, or of two discs that have met, and recompute their bounds."""
        for i in discs:
            self._load(i)
        cdef Py_ssize_t first = discs[0], last = discs[len(discs) - 1]
        with nogil:
            renew(&self.table, first, last)

    def earliest(self):
        """Return the smallest bound of all pairs, with the numbers of the pair's bodies."""
        cdef Py_ssize_t i
        cdef Py_ssize_t best = 0
        for i in range(1, self.table.discs):
            if self.table.least[i].bound < self.table.least[best].bound:
                best = i
        return self.table.least[best].bound, best, self._body(self.table.least[best].column)

    def raise_to(self, Py_ssize_t disc, Py_ssize_t body, double bound):
        """Replace a bound by a larger one, which is more accurate."""
        self.table.bounds[disc * self.table.width + self._column(body)] = bound
        find_least(&self.table, disc)

    def up_to(self, double time):
        """Return all bounds up to a time, each with the numbers of the pair's bodies."""
        table = &self.table
        cdef Py_ssize_t i, k
        return [
            (table.bounds[i * table.width + k], i, self._body(k))
            for i in range(table.discs)
            if not table.least[i].bound > time
            for k in range(table.width)
            if not table.bounds[i * table.width + k] > time
        ]

    cdef Py_ssize_t _column(self, Py_ssize_t body) except -1:
        return body if body >= 0 else self.table.discs + <Py_ssize_t>wall_index(body)

    cdef _body(self, Py_ssize_t column):
        return column if column < self.table.discs else wall_body(column - self.table.discs)

    cdef _load(self, Py_ssize_t i):
        """Read the state of a disc."""
        bodies = self.bodies
        path = &self.table.paths[i]
        x, y, vx, vy = bodies.x[i], bodies.y[i], bodies.vx[i], bodies.vy[i]
        path.time = bodies.time[i]
        path.x, path.y = ldexp(x, -self.length), ldexp(y, -self.length)
        path.vx, path.vy = ldexp(vx, -self.speed), ldexp(vy, -self.speed)
        path.radius = ldexp(bodies.scene.discs[i].radius_m, -self.length)
        path.rim = path.radius * (1.0 + 8.0 * ROUNDOFF)
        path.immovable = not bodies.movable[i]
        path.bends = bodies.is_curved(i)
        fastest = greater(fabs(path.vx), fabs(path.vy))
        path.error = 19.0 * ROUNDOFF * (greater(fabs(path.x), fabs(path.y)) + path.rim)
        path.error += ldexp(spread(x) + spread(y), -self.length) + tiny(self.length)
        path.error_v = 19.0 * ROUNDOFF * fastest + ldexp(spread(vx) + spread(vy), -self.speed) + tiny(self.speed)
        if not fastest < FASTEST:
            path.error = INF
        path.met = NOBODY
        partner = bodies.partner[i]
        if partner is not None and (not self.table.falls if partner < 0 else bodies.have_just_met(i, partner)):
            path.met = self._column(partner)
            hollow = partner < 0 and self.table.walls[path.met - self.table.discs].form == HOLLOW
            if hollow or path.bends or (partner >= 0 and bodies.is_curved(partner)):
                path.met = NOBODY

    cdef _load_wall(self, Py_ssize_t k):
        """Read a wall."""
        wall = &self.table.walls[k]
        shape = self.bodies.obstacles[k].shape
        if self.bodies.is_driven(k):
            wall.form = HOLLOW
            return
        if isinstance(shape, Round):
            wall.form = HOLLOW if shape.inside else ROUND
            law = self.bodies.laws.of_round(k, 0.0)  # the contact distance of a disc of radius 0
            wall.round.x, wall.round.y = ldexp(law.cx, -self.length), ldexp(law.cy, -self.length)
            wall.round.radius = ldexp(law.reach, -self.length)
            wall.round.rim = wall.round.radius * (1.0 + 8.0 * ROUNDOFF)
            wall.round.immovable, wall.round.met = True, NOBODY
            wall.round.error = 19.0 * ROUNDOFF * (greater(fabs(wall.round.x), fabs(wall.round.y)) + wall.round.rim)
            wall.round.error += tiny(self.length)
            return
        law = self.bodies.laws.of_straight(k, 0.0)  # the level of a disc of radius 0
        # The normal of a face is as long as its edge, and is scaled to a length of about 1. The margins include the
        # rounding error of scaling.
        _, size = frexp(float_above(law.length))
        scale = arb((1, -size))
        wall.nx, wall.ny = law.nx * scale, law.ny * scale
        wall.span = fabs(wall.nx) + fabs(wall.ny)
        wall.length = float_above(law.length * scale)
        wall.level = ldexp(float_above(law.level * scale), -self.length)
        wall.level += 8.0 * ROUNDOFF * fabs(wall.level)


cdef double spread(ball):
    """Return half of an interval's width; 0 if the width is within the rounding margin of the converted number."""
    return 0.0 if ball.rel_accuracy_bits() >= SHARP_BITS else ball.rad()


cdef double tiny(int scale) noexcept:
    """Return TINY plus a bound of the error of a float that underflows, scaled by 2^-scale."""
    return TINY + ldexp(1.0, -1070 - scale)
