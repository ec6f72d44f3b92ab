"""The event queue: a tournament tree of the times of all discs' next events, eight to a match.

The eight times of a match share a cache line. The least of them goes up a level, and with it the number of the disc that
holds it. Nothing is ever moved or deleted, as in a heap: a disc's time is overwritten.
"""

from carom.physics.double_double cimport lesser
from carom.solvers.event_driven.layout cimport *

cdef struct Sibling:
    double time
    Index place  # in its level


cdef inline Index lay_out_queue(Queue *q, Index discs) noexcept nogil:
    """Divide a queue into levels; return how many times it holds, or -1 where there are too many discs."""
    cdef Index length = 0
    cdef Index size = discs
    q.discs = discs
    q.top = -1
    while q.top < LEVELS - 1:
        q.top += 1
        q.level[q.top] = length
        length += (size + SIBLINGS - 1) // SIBLINGS * SIBLINGS
        if size == 1 and q.top > 0:
            return length
        size = (size + SIBLINGS - 1) // SIBLINGS
    return -1


cdef inline Sibling best_sibling(const double *times, Index place) noexcept nogil:
    """Return the least of the other seven times of a match, in three rounds that a processor can overlap."""
    cdef Index at_bc, at_abc, at_de, at_fg, at_defg
    a = times[place ^ 1]
    b = times[place ^ 2]
    c = times[place ^ 3]
    d = times[place ^ 4]
    e = times[place ^ 5]
    f = times[place ^ 6]
    g = times[place ^ 7]
    bc = lesser(b, c)
    de = lesser(d, e)
    fg = lesser(f, g)
    abc = lesser(a, bc)
    defg = lesser(de, fg)
    at_bc = 2 if b < c else 3
    at_de = 4 if d < e else 5
    at_fg = 6 if f < g else 7
    at_abc = 1 if a < bc else at_bc
    at_defg = at_de if de < fg else at_fg
    return Sibling(lesser(abc, defg), place ^ (at_abc if abc < defg else at_defg))


cdef inline void set_time(Queue *q, Index i, double time) noexcept nogil:
    """Give disc `i` the time of its next event, and carry that up as far as it matters."""
    cdef Index level, above, other, earlier
    cdef Index place = i
    cdef Index holder = i
    q.time[i] = time
    for level in range(q.top):
        above = q.level[level + 1] + (place >> 3)
        if time > q.time[above]:
            if q.holder[above] >> 3 * level != place:
                return  # the match has another winner
            best = best_sibling(q.time + q.level[level], place)
            other = best.place if level == 0 else q.holder[q.level[level] + best.place]
            earlier = best.time < time
            holder += (other - holder) * earlier  # which of the two it is can't be foreseen: no branch
            time = lesser(best.time, time)
        elif time == q.time[above] and q.holder[above] >> 3 * level != place:
            return
        q.time[above] = time
        q.holder[above] = <int>holder
        place >>= 3


cdef inline Index earliest(const Queue *q) noexcept nogil:
    """Return the disc of the earliest event, one of them where several share the time."""
    return q.holder[q.level[q.top]]


cdef inline double earliest_but(const Queue *q, Index i, Index j) noexcept nogil:
    """Return the earliest time of all discs but `i` and `j`, which may be the same disc."""
    cdef Index level, k
    cdef double least = INF
    for level in range(q.top):
        times = q.time + q.level[level]
        if i == j or i >> 3 != j >> 3:
            least = lesser(least, best_sibling(times, i).time)
            if i != j:
                least = lesser(least, best_sibling(times, j).time)
        else:
            for k in range(1, 8):
                if i ^ k != j:
                    least = lesser(least, times[i ^ k])
        i >>= 3
        j >>= 3
    return least


cdef inline Index next_at(const Queue *q, Index i, double time) noexcept nogil:
    """Return the first disc from `i` on whose time is `time` or less, or the number of discs where there is none."""
    cdef Index level
    while i < q.discs:
        if q.time[i] <= time:
            return i
        # Leap over the largest subtree that begins at i and holds nothing so early.
        level = 0
        while (
            level < q.top
            and i & ((<Index>8 << 3 * level) - 1) == 0
            and q.time[q.level[level + 1] + (i >> 3 * (level + 1))] > time
        ):
            level += 1
        i += <Index>1 << 3 * level
    return q.discs


cdef inline Index runner_up(const Queue *q, Index i) noexcept nogil:
    """Return the disc that most likely comes after disc `i`, the earliest: as the last two rounds tell."""
    cdef Index last = q.top - 1
    upper = best_sibling(q.time + q.level[last], i >> 3 * last)
    lower = best_sibling(q.time + q.level[last - 1], i >> 3 * (last - 1))
    if upper.time < lower.time:
        return q.holder[q.level[last] + upper.place]
    return q.holder[q.level[last - 1] + lower.place]
