"""For how long a disc can meet nothing: a lower bound of the time of impact that holds for PIT's rounded paths.

Between impacts a disc moves straight, so two of them overlap from the lesser root of ``|d + u t| = R`` on, if there is
one (`docs/physics.md`). PIT's discs are moved frame by frame, each move rounded, so they are a little beside that path.
Hence the root is taken of a contact distance that is too large by more than all rounding can amount to:

- *Of the path.* A move rounds each coordinate twice: the product ``v dt``, by 2^-53 of it, and the sum, by 2^-53 of the
  coordinate. (``dt`` is exact: it is the difference of two floats that lie within a factor of 2, or the later of which
  follows 0.) Over the `MOST_FRAMES` = 2^16 that a bound is used at most, the products add up to 2^-53 of the way, the
  sums to 2^-37 of the largest coordinate on it. So two discs are seen from each other less than 2^-36 of their `extent`
  beside the straight path, the extent being the sum of what ``|x| + |y|`` of either can grow to. Velocities seen from
  each other are rounded by 2^-53, which turns the path by as much of its length. `PATH_MARGIN` is four times all this.
- *Of the bound itself.* With S = ``|d|^2``, a = ``|u|^2`` and the distance I so enlarged, it is
  ``(S - I^2) / (sqrt(D) - d.u)``, D = ``a I^2 - (d x u)^2``. Its terms are rounded by less than 2^-49 of S, of ``a I^2``
  and of ``|d| |u|``. Where S is within 2^28 of I^2 that is less than what `CONTACT_MARGIN` = 2^-20 has added to I^2,
  and beyond it is less than 2^-48 of S - I^2, for which the wait is cut by `PATH_MARGIN` of itself.
- *Of time.* A frame's instant and the sum of now and the wait are rounded by 2^-53 of themselves each, for which
  `TIME_MARGIN` is taken off.

Where anything over- or underflows, the bound is 0 by the form of the comparisons: then nothing is left out.
"""

from libc.math cimport fabs, sqrt

from carom.solvers.event_driven.layout cimport INF, Wall
from carom.solvers.pit.layout cimport Disc, State

cdef enum:
    MOST_FRAMES = 65536  # 2^16

cdef extern from *:
    """
    #define carom_PATH_MARGIN 0x1p-34
    #define carom_CONTACT_MARGIN 0x1p-20
    #define carom_TIME_MARGIN 0x1p-50
    #define carom_IN_CONTACT (-1.0)
    """
    const double PATH_MARGIN "carom_PATH_MARGIN"
    const double CONTACT_MARGIN "carom_CONTACT_MARGIN"
    const double TIME_MARGIN "carom_TIME_MARGIN"
    const double IN_CONTACT "carom_IN_CONTACT"  # a wait: the two approach and may overlap at this very frame


cdef inline double extent(const State *s, const Disc *a) noexcept nogil:
    """Return what |x| + |y| of a disc can grow to while a bound is used, metres."""
    return fabs(a.x) + fabs(a.y) + (fabs(a.vx) + fabs(a.vy)) * s.horizon


cdef inline double shortened(double wait) noexcept nogil:
    """Return a wait less what its own rounding may be; 0 where it has come out as no number."""
    return wait * (1.0 - PATH_MARGIN) if 0.0 < wait < INF else 0.0


cdef inline double pair_wait(const State *s, const Disc *a, const Disc *b, double extent_a) noexcept nogil:
    """Return the seconds for which two discs can't interfere on their present paths; INF for never, or IN_CONTACT.

    0 where they may, or may soon, at the frame that follows.
    """
    dx = b.x - a.x
    dy = b.y - a.y
    ux = b.vx - a.vx
    uy = b.vy - a.vy
    along = dx * ux + dy * uy
    squared = dx * dx + dy * dy
    margin = PATH_MARGIN * (extent_a + extent(s, b))
    contact = (a.radius + b.radius) * (1.0 + CONTACT_MARGIN) + margin
    if squared > contact * contact:
        if along >= 0.0:
            return INF
        speed_squared = ux * ux + uy * uy
        across = dx * uy - dy * ux
        d = speed_squared * (contact * contact) - across * across
        if d < 0.0:
            return INF
        return shortened((squared - contact * contact) / (sqrt(d) - along))
    if along < 0.0:  # the very number that PIT tests
        return IN_CONTACT
    # While they part, `along` grows, but for rounding. At rest to each other, it is 0 and stays 0.
    if along > margin * (fabs(ux) + fabs(uy)) or (ux == 0.0 and uy == 0.0):
        return INF
    return 0.0


cdef inline double wall_wait(const Disc *a, const Wall *wall, double extent_a) noexcept nogil:
    """Return the seconds for which a disc can't interfere with a wall on its present path; INF for never, or IN_CONTACT.

    The gap is linear in time; its speed, too, is rounded, by less than 2^-51 of the disc's own.
    """
    along = a.vx * wall.nx + a.vy * wall.ny
    if along >= 0.0:  # the very number that PIT tests, at every frame
        return INF
    margin = PATH_MARGIN * (extent_a + fabs(wall.x) + fabs(wall.y) + a.radius)
    gap = (a.x - wall.x) * wall.nx + (a.y - wall.y) * wall.ny - a.radius - margin
    if gap > 0.0:
        return shortened(gap / (PATH_MARGIN * (fabs(a.vx) + fabs(a.vy)) - along))
    return IN_CONTACT


cdef inline double due_time(double now, double wait) noexcept nogil:
    """Return a time that is before the end of a wait from now on."""
    return (now + wait) * (1.0 - TIME_MARGIN)
