"""Where the rows of a run are: all in one piece of memory."""

from carom.solvers.event_driven.grid cimport cell_count, tile_count
from carom.solvers.event_driven.layout cimport *


cdef inline char *reserve(char **place, size_t size) noexcept nogil:
    """Return where a part of a piece of memory begins, and go on to the next: each begins at a cache line."""
    begin = place[0]
    place[0] = begin + (size + 63) // 64 * 64
    return begin


cdef inline size_t lay_out(State *s, char *memory, Index queue_length) noexcept nogil:
    """Place all rows of a run in a piece of memory; return how many bytes they take."""
    cdef char *end = memory
    s.discs = <Disc *>reserve(&end, s.disc_count * sizeof(Disc))
    s.predictions = <Prediction *>reserve(&end, s.disc_count * sizeof(Prediction))
    s.queue.time = <double *>reserve(&end, queue_length * sizeof(double))
    above = s.queue.level[1]  # what lies below has no holders
    s.queue.holder = <int *>reserve(&end, (queue_length - above) * sizeof(int)) - above
    s.grid.cells = <Cell *>reserve(&end, cell_count(&s.grid) * sizeof(Cell))
    s.grid.chain = <int *>reserve(&end, s.disc_count * sizeof(int))
    s.grid.list_of = <unsigned int *>reserve(&end, tile_count(&s.grid) * sizeof(int))
    s.walls = <Wall *>reserve(&end, s.wall_count * sizeof(Wall))
    s.features = <Feature *>reserve(&end, s.feature_count * sizeof(Feature))
    s.driving.rows = <Driven *>reserve(&end, s.driving.count * sizeof(Driven))
    s.driving.legs = <Leg *>reserve(&end, s.driving.leg_count * sizeof(Leg))
    to_and_fro = <ToAndFro *>reserve(&end, s.disc_count * sizeof(ToAndFro) if s.driving.leg_count > 0 else 0)
    s.to_and_fro = to_and_fro if s.driving.leg_count > 0 else NULL
    s.wall_laws = <Law *>reserve(&end, s.wall_count * sizeof(Law) if s.feature_count > 0 else 0)
    s.last_impact = <double *>reserve(&end, s.disc_count * sizeof(double) if s.law.contact_duration > 0.0 else 0)
    turning = <Turning *>reserve(&end, s.disc_count * sizeof(Turning) if s.record.turns else 0)
    s.turning = turning if s.record.turns else NULL
    return <size_t>(end - memory)
