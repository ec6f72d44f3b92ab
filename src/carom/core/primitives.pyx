"""Single formulas of the core for Python: times of impact, features of a wall, and impulses.

Lengths are in metres, velocities in m/s, times in seconds from now. A time is 0 for bodies that approach
while they touch or overlap, and infinity for bodies that never collide. A disc relative to a wall is a
`carom.core.wall_features.Mover`.
"""

from cpython.mem cimport PyMem_Free, PyMem_Malloc
from libc.math cimport NAN, fabs, sqrt

from carom.core cimport formulas
from carom.core.carom_core cimport ContactFriction
from carom.core.exact_quartic cimport ExactQuartic, exact_solver
from carom.core.formulas cimport (
    CAROM_INF, CAROM_PAIR_LEAST, CAROM_PAIR_MOST, FACE, FEATURE_NUMBERS, INNER_ARC, DoubleDouble,
    FallingDisc, Feature, Mover, Slips, feature_from, greater, lesser,
)


cdef extern from "carom/core/straight/pair_time.h" nogil:
    # the seconds until two discs collide
    cpdef double pair_time(
        double x1, double y1, double vx1, double vy1, double r1,
        double x2, double y2, double vx2, double vy2, double r2,
    )

cdef extern from "carom/core/impact_law.h" nogil:
    # The factor g <= 0 of the normal impulse. Disc 1 receives the impulse g d, with d = c2 - c1 and u = v2 - v1.
    cpdef double normal_impulse(double dx, double dy, double ux, double uy, double inverse_masses, double restitution)


cdef inline bint is_moderate(double a) noexcept nogil:
    size = fabs(a)
    return (CAROM_PAIR_LEAST <= size) & (size < CAROM_PAIR_MOST) | (size == 0.0)


# ---- times of impact ----


def fill_pair_times(
    const double[:, :] p1, const double[:, :] v1, const double[:] r1,
    const double[:, :] p2, const double[:, :] v2, const double[:] r2, double[::1] times,
):
    """Write the time of impact of each pair of discs into `times`, or NaN if a number is not moderate."""
    cdef Py_ssize_t k
    cdef bint moderate
    with nogil:
        for k in range(times.shape[0]):
            x1, y1, vx1, vy1 = p1[k, 0], p1[k, 1], v1[k, 0], v1[k, 1]
            x2, y2, vx2, vy2 = p2[k, 0], p2[k, 1], v2[k, 0], v2[k, 1]
            moderate = is_moderate(x2 - x1) & is_moderate(y2 - y1) & is_moderate(vx2 - vx1) & is_moderate(vy2 - vy1)
            moderate = moderate & is_moderate(r1[k] + r2[k])
            times[k] = pair_time(x1, y1, vx1, vy1, r1[k], x2, y2, vx2, vy2, r2[k]) if moderate else NAN


def wall_time(double x, double y, double vx, double vy, double radius, wall):
    """Return the seconds until a disc touches `wall`, a `carom.model.disc_arrays.HalfPlane`."""
    qx, qy, nx, ny = wall
    return formulas.wall_time(x, y, vx, vy, radius, qx, qy, nx, ny)


def wall_fall_time(double x, double y, double vx, double vy, double radius, wall, double ax, double ay):
    """Return the seconds until a disc with a constant acceleration touches a half-plane."""
    cdef double qx, qy, nx, ny
    qx, qy, nx, ny = wall
    gap = formulas.wall_gap(x, y, radius, qx, qy, nx, ny)
    return formulas.descent_time(gap, formulas.wall_speed(vx, vy, nx, ny), formulas.wall_speed(ax, ay, nx, ny))


def disc_fall_time(
    double x, double y, double vx, double vy, double radius, double fixed_x, double fixed_y, double fixed_radius,
    double ax, double ay, leaving=None,
):
    """Return the seconds until an accelerating disc touches a fixed disc.

    If the accelerating disc has just hit the fixed disc, `leaving` is its normal speed after the impact. The gap is
    then assumed to be exactly 0 with the rate of change `leaving`. If `leaving` is None, the disc's path does not begin
    with an impact on the fixed disc.
    """
    cdef ExactQuartic exact = exact_solver()
    cdef FallingDisc disc = FallingDisc(x, y, vx, vy, radius)
    cdef bint has_left = leaving is not None
    cdef double speed = leaving if has_left else 0.0
    return formulas.disc_fall_time(&exact, &disc, fixed_x, fixed_y, fixed_radius, ax, ay, has_left, speed)


# ---- features of a wall ----


cdef class WallFeatures:
    """The features of a finite wall, by number. If a disc hits several features at once, the lowest number counts.

    Args:
        rows: A row of numbers for each feature, as `carom.core.input_rows.build_feature_row` returns it.
    """

    cdef Feature *rows
    cdef int count

    def __cinit__(self, rows):
        cdef double[FEATURE_NUMBERS] numbers
        cdef int k, n
        self.count = len(rows)
        self.rows = <Feature *> PyMem_Malloc(self.count * sizeof(Feature))
        if self.rows == NULL:
            raise MemoryError
        for k in range(self.count):
            for n in range(FEATURE_NUMBERS):
                numbers[n] = rows[k][n]
            self.rows[k] = feature_from(numbers)

    def __dealloc__(self):
        PyMem_Free(self.rows)

    cdef const Feature *at(self, int number) except NULL:
        if not 0 <= number < self.count:
            raise IndexError(f"no feature {number} of {self.count}")
        return &self.rows[number]

    def first_touch(self, disc, int last):
        """Return when a disc hits its first feature, the number of this feature, and whether the disc glides.

        The path of the disc is straight. The last impact of the disc was on the feature `last`, or on no feature if
        `last` is -1. The returned number is -1 if the disc hits no feature. A disc glides if it stays in contact with
        an arc without an impact.
        """
        cdef Mover seen = mover_from(disc)
        cdef double least = CAROM_INF
        cdef int first = -1, k
        cdef bint glides = False
        for k in range(self.count):
            touch = formulas.feature_time(&seen, &self.rows[k], formulas.JUST_LEFT if k == last else formulas.ELSEWHERE)
            if touch.time < least:
                least, first, glides = touch.time, k, touch.glides
        return least, first, glides

    def first_fall(self, disc, double ax, double ay, int last, double leaving):
        """Return when an accelerating disc hits its first feature, and the number of this feature.

        `last` is the feature of the disc's last impact, as in `first_touch`. After that impact, the disc had the normal
        speed `leaving`.
        """
        cdef ExactQuartic exact = exact_solver()
        cdef Mover seen = mover_from(disc)
        cdef double least = CAROM_INF
        cdef int first = -1, k
        for k in range(self.count):
            time = formulas.feature_fall_time(&exact, &seen, &self.rows[k], ax, ay, k == last, leaving)
            if time < least:
                least, first = time, k
        return least, first

    def normal(self, int number, disc):
        """Return the unit vector from a feature to a disc that touches it."""
        cdef Mover seen = mover_from(disc)
        normal = formulas.normal_at(self.at(number), &seen)
        return normal.x, normal.y

    def gap(self, int number, disc):
        """Return the distance of a disc's rim from a feature, along the normal."""
        cdef Mover seen = mover_from(disc)
        return formulas.feature_gap(&seen, self.at(number))

    def overlap_start(self, int number, disc):
        """Return when a disc began to touch a feature that it now overlaps and approaches, in seconds from now.

        The path is straight, and times are computed in double precision. The result is 0 or negative. The result is 0
        if the speed of approach is 0 after rounding.
        """
        cdef Mover seen = mover_from(disc)
        cdef const Feature *feature = self.at(number)
        cdef double vx = seen.ux.high, vy = seen.uy.high, gap = lesser(formulas.feature_gap(&seen, feature), 0.0)
        normal = formulas.normal_at(feature, &seen)
        cdef double speed = vx * normal.x + vy * normal.y
        if feature.kind <= FACE:
            return -gap / speed if speed < 0.0 else 0.0
        cdef double x = seen.x.high - feature.x.high, y = seen.y.high - feature.y.high
        cdef double away = sqrt(x * x + y * y), reach = formulas.reach_of(&seen, feature).high
        cdef double sign = -1.0 if feature.kind == INNER_ARC else 1.0
        # |d + t u| = reach is solved for t, where d is the vector from the feature's centre to the disc's centre, and u
        # is the disc's velocity. The result is the later of the roots that are not positive.
        cdef double a = vx * vx + vy * vy, b = sign * away * speed, c = sign * gap * (away + reach)
        cdef double root = sqrt(greater(b * b - a * c, 0.0))
        if sign > 0.0:
            return (-b - root) / a
        return -c / (b + root) if b + root > 0.0 else 0.0


cdef Mover mover_from(disc):
    x, y, ux, uy, radius = disc
    return Mover(pair_from(x), pair_from(y), pair_from(ux), pair_from(uy), radius)


cdef DoubleDouble pair_from(pair):
    return DoubleDouble(pair[0], pair[1])


def two_diff(double a, double b):
    """Return the rounded difference ``a - b`` and its rounding error."""
    difference = formulas.two_diff(a, b)
    return difference.high, difference.low


# ---- impulses ----


def tangential_impulse(
    double friction, double restitution, double slip, double inverse_effective_mass, double pressed
):
    """Return the impulse of friction on two bodies that a normal impulse of 0 or more presses together.

    Args:
        friction: Coulomb's coefficient.
        restitution: Tangential coefficient of restitution.
        slip: Velocity of the first body's surface relative to the second body's surface.
        inverse_effective_mass: Decrease of the slip divided by the impulse, above 0.
        pressed: Normal impulse.
    """
    cdef ContactFriction contact = ContactFriction(friction, restitution)
    return formulas.tangential_impulse(&contact, slip, inverse_effective_mass, pressed)


def pair_tangential_impulse(
    double friction, double restitution, double dx, double dy, double ux, double uy, double surface,
    double inverse_effective_mass, double normal,
):
    """Return the factor h of the impulse of friction. The first disc receives the impulse ``h (dy, -dx)``.

    d is the vector from the first centre to the second, and u is the velocity of the second disc relative to the first.
    `surface` is ``|d| (R1 w1 + R2 w2)``, with radii R and spins w. `normal` is the result of `normal_impulse`.
    """
    cdef ContactFriction contact = ContactFriction(friction, restitution)
    return formulas.pair_tangential_impulse(&contact, dx, dy, ux, uy, surface, inverse_effective_mass, normal)


def frictional_impulses(
    double friction, double restitution, double rolling_resistance, double slip, double rim,
    double inverse_inertia_ratio, double pressed,
):
    """Return the impulses of friction on the centre and on the rim of a disc that hits a wall, per unit of mass.

    The impulse on the rim includes rolling resistance. The third result is whether rolling resistance stops the spin.
    """
    cdef ContactFriction contact = ContactFriction(friction, restitution)
    by = formulas.frictional_impulses(&contact, rolling_resistance, Slips(slip, rim), inverse_inertia_ratio, pressed)
    return by.friction, by.turning, by.blocks
