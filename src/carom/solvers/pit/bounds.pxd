"""For how long a disc can meet nothing: a lower bound of the time of impact that holds for PIT's rounded paths.

Between impacts a disc moves straight, so two of them overlap from the lesser root of ``|d + u t| = R`` on, if there is
one (`docs/physics.md`). PIT's discs are moved frame by frame, each move rounded, so they are a little beside that path.
Hence the root is taken of a distance I that is larger than R by `MARGIN` of E, the sum of what ``|x| + |y|`` of both can
grow to. Three things use it up; E is never less than ``|d|``, which is R or more until they overlap.

- *The path.* A move rounds each coordinate twice: the product ``v dt``, by 2^-53 of it, and the sum, by 2^-53 of the
  coordinate. (``dt`` is exact, a difference of floats within a factor of 2, or from 0.) Over the `MOST_FRAMES` = 2^16
  that a bound is used at most, the products lose 2^-53 of the way, the sums 2^-37 of the largest coordinate. Velocities
  seen from each other, and the test of PIT, are rounded by a few 2^-53. All together is below 2^-36 E: what is still
  proven of the exact path with ``P = R + 2^-36 E``, at least ``3 * 2^-36 E`` below I, is proven of PIT's.
- *Whether they meet.* With ``a = |u|^2``, they pass each other at the distance ``|d x u| / |u|``. That is computed to
  2^-50 ``(|d| + I)``, so where ``D = a I^2 - (d x u)^2`` comes out below 0 the distance is above P.
- *When.* With ``N = |d|^2 - I^2``, that is at ``N / (sqrt(D) - d.u)``. D is computed to 2^-49 ``a I |d|``, less than
  what it would fall with P for I. N is computed to 2^-49 ``|d|^2``: up to ``|d| = 2^14 I`` less than the
  2^-35 ``I |d|`` that it would grow with P for I, and beyond 2^-48 of N. ``d.u`` is computed to 2^-51 ``|d| |u|``: where
  N is 2^-30 ``|d|^2`` or more, 2^-36 of itself, as its square is ``a N + D``; and below that, where N with P for I is
  larger by a 33rd or more, less than that outweighs. So what is found, less `MARGIN` of itself, is before they meet.

The sum of now and the wait, and the instants of frames, are rounded by 2^-53 of themselves each: `TIME_MARGIN`. Where
anything over- or underflows the comparisons come out so that the wait is 0, and nothing is left out.
"""

from libc.math cimport fabs, sqrt

from carom.solvers.event_driven.layout cimport INF, Wall
from carom.solvers.pit.layout cimport Disc, State

cdef enum:
    MOST_FRAMES = 65536  # 2^16

cdef extern from *:
    """
    #define carom_PIT_MARGIN 0x1p-34
    #define carom_TIME_MARGIN 0x1p-50
    #define carom_IN_CONTACT (-1.0)
    """
    const double MARGIN "carom_PIT_MARGIN"
    const double TIME_MARGIN "carom_TIME_MARGIN"
    const double IN_CONTACT "carom_IN_CONTACT"  # a wait: the two approach and may overlap at this very frame


cdef inline double extent(const State *s, const Disc *a) noexcept nogil:
    """Return what |x| + |y| of a disc can grow to while a bound is used, metres."""
    return fabs(a.x) + fabs(a.y) + (fabs(a.vx) + fabs(a.vy)) * s.horizon


cdef inline double shortened(double wait) noexcept nogil:
    """Return a wait less what its own rounding may be; 0 where it has come out as no number."""
    return wait * (1.0 - MARGIN) if 0.0 < wait < INF else 0.0


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
    margin = MARGIN * (extent_a + extent(s, b))
    contact = a.radius + b.radius + margin
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
    margin = MARGIN * (extent_a + fabs(wall.x) + fabs(wall.y) + a.radius)
    gap = (a.x - wall.x) * wall.nx + (a.y - wall.y) * wall.ny - a.radius - margin
    if gap > 0.0:
        return shortened(gap / (MARGIN * (fabs(a.vx) + fabs(a.vy)) - along))
    return IN_CONTACT


cdef inline double due_time(double now, double wait) noexcept nogil:
    """Return a time that is before the end of a wait from now on."""
    return (now + wait) * (1.0 - TIME_MARGIN)
