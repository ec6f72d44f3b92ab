"""Frame instants, and how discs get from one to the next.

``x += v dt`` at every frame, each product and sum rounded: that is what the definition does, so a disc can't be taken
over many frames in one step. But it can be taken over many frames before the next disc is.
"""

from carom.solvers.event_driven.layout cimport Index
from carom.solvers.pit.layout cimport MOST_STEPS, Clock, Disc, State


cdef inline double frame_time(const Clock *clock, Index frame) noexcept nogil:
    """Return the instant of a frame, seconds since the start."""
    return frame * clock.step / clock.rate


cdef inline void move_discs(State *s, double step) noexcept nogil:
    """Take every disc that moves over one step, seconds."""
    cdef Index i
    for i in range(s.disc_count):
        disc = &s.discs[i]
        if disc.inverse_mass != 0.0:
            disc.x += disc.vx * step
            disc.y += disc.vy * step


cdef inline void move_two(Disc *a, Disc *b, const double *steps, Index count) noexcept nogil:
    """Take two discs over some steps, one after the other; two at a time, as each sum waits for the one before it."""
    cdef Index k
    ax, ay, avx, avy = a.x, a.y, a.vx, a.vy
    bx, by, bvx, bvy = b.x, b.y, b.vx, b.vy
    for k in range(count):
        ax += avx * steps[k]
        ay += avy * steps[k]
        bx += bvx * steps[k]
        by += bvy * steps[k]
    if a.inverse_mass != 0.0:
        a.x, a.y = ax, ay
    if b.inverse_mass != 0.0:
        b.x, b.y = bx, by


cdef inline void pass_frames(State *s, Index count) noexcept nogil:
    """Take every disc over the first `count` of `s.steps`."""
    cdef Index i
    cdef Index n = s.disc_count
    cdef Disc nobody
    for i in range(0, n - 1, 2):
        move_two(&s.discs[i], &s.discs[i + 1], s.steps, count)
    if n % 2 == 1:
        nobody = s.discs[n - 1]
        move_two(&s.discs[n - 1], &nobody, s.steps, count)


cdef inline void go_to_next_frame(State *s) noexcept nogil:
    """Take every disc to the frame that comes next."""
    time = frame_time(&s.clock, s.counts.frames)
    if s.counts.frames > 0:
        move_discs(s, time - s.now)
    s.now = time


cdef inline Index skip_frames(State *s, Index until) noexcept nogil:
    """Pass frames, up to `until`, at which no disc is due; return how many."""
    cdef Index count = 0
    cdef Index most = until - s.counts.frames
    if most > MOST_STEPS:
        most = MOST_STEPS
    while count < most:
        time = frame_time(&s.clock, s.counts.frames + count)
        if time >= s.next_look:
            break
        s.steps[count] = time - s.now
        s.now = time
        count += 1
    if count > 0:
        pass_frames(s, count)
        s.counts.frames += count
    return count
