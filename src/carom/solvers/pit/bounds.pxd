"""For how long a disc can meet nothing: a lower bound of the time of impact that holds for PIT's rounded paths.

`docs/physics.md`, section 4, derives it: the root is taken of a contact distance enlarged by `PATH_MARGIN` of what
``|x| + |y|`` of both discs can grow to over `MOST_FRAMES` frames. Where anything over- or underflows the comparisons
come out so that the wait is 0, and nothing is left out.
"""

from libc.math cimport fabs, sqrt

from carom.constants cimport IN_CONTACT, INF, PATH_MARGIN, TIME_MARGIN
from carom.solvers.impact.structs cimport Wall
from carom.solvers.pit.layout cimport Disc, State
from carom.solvers.pit.stretches cimport Finite, distance_at_least

cdef enum:
    MOST_FRAMES = 65536  # 2^16: after that many a bound is found anew

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
    contact = a.radius + b.radius + margin
    if squared > contact * contact:
        if along >= 0.0:
            return INF
        across = dx * uy - dy * ux
        d = (ux * ux + uy * uy) * (contact * contact) - across * across
        if d < 0.0:
            return INF
        return shortened((squared - contact * contact) / (sqrt(d) - along))
    if along < 0.0:  # the very number that PIT tests
        return IN_CONTACT
    # While they part, `along` grows, except for rounding. At rest to each other, it is 0 and stays 0.
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


cdef inline double finite_wait(const Disc *a, const Finite *wall, double extent_a) noexcept nogil:
    """Return the seconds for which a disc can't interfere with a finite wall on its present path, as `wall_wait` does.

    No nearer point of the wall comes to it faster than it moves. What bends, or has another side, is left and met again.
    """
    if a.vx == 0.0 and a.vy == 0.0:  # it does not approach
        return INF
    margin = PATH_MARGIN * (extent_a + wall.size + a.radius)
    gap = distance_at_least(wall, a.x, a.y) - (wall.half_width + a.radius) - margin
    if gap > 0.0:
        return shortened(gap / (sqrt(a.vx * a.vx + a.vy * a.vy) * (1.0 + PATH_MARGIN)))
    return IN_CONTACT
