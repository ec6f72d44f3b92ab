"""The narrow phase: which disc a disc meets next.

The time at which two discs meet is counted from the later of their own times, so it depends on their two paths alone. A
scan bounds these times by the plain form, and solves a pair to the last digit only where the bounds do not tell two
candidates apart; the winner is solved when it comes to be the next event of all.

A scan takes four rounds, each over all that the one before has left, with as few branches as can be: a processor can't
foresee which discs are near and which approach, and a wrong guess costs it as much as the arithmetic of a pair.
"""

from cython cimport likely, unlikely
from libc.math cimport fabs, sqrt

from carom.constants cimport CERTAIN, ROOT_ERROR
from carom.physics.double_double cimport greater, lesser
from carom.physics.pair_time cimport approach, discriminant, pair_time, separation
from carom.solvers.event_driven.grid cimport cells_around, new_neighbours
from carom.solvers.event_driven.layout cimport *

cdef struct Chains:  # of a block of cells, as far as they have not been looked at
    Index left  # how many, with the one that has been begun
    Index disc  # with which that one goes on, or NOBODY


cdef inline double pair_event_time(const State *s, Index i, Index j) noexcept nogil:
    """Return when discs `i` and `j` meet on their present paths, infinity for never."""
    a = &s.discs[i if i < j else j]
    b = &s.discs[j if i < j else i]
    start = greater(a.time, b.time)
    wait_a = start - a.time
    wait_b = start - b.time
    return start + pair_time(
        a.x + a.vx * wait_a, a.y + a.vy * wait_a, a.vx, a.vy, a.radius,
        b.x + b.vx * wait_b, b.y + b.vy * wait_b, b.vx, b.vy, b.radius,
    )


cdef inline Index just_met(const State *s, Index i) noexcept nogil:
    """Return the disc that disc `i` met last, if both are still on the paths that this gave them, else NOBODY.

    Such a pair never meets again on these paths: what rounding leaves of their approach (all that there is of it, where
    the restitution is 0) must not become an impact, and another, without end. A disc that never moves is always on its
    path.
    """
    cdef Index last = s.discs[i].last
    if last < 0:
        return NOBODY
    return last if s.discs[last].inverse_mass == 0.0 or s.discs[last].last == i else NOBODY


cdef inline Index gather(State *s, Block block, Chains *chains) noexcept nogil:
    """Round 1: find the discs in a block of cells, those on chains left out; return how many."""
    cdef Index line, k, place, disc
    cdef Index count = 0
    cdef Index left = 0
    for line in range(block.lines):
        for k in range(3):
            cell = &s.grid.cells[block.first + line * block.to_line + k * block.to_cell]
            for place in range(PLACES):
                disc = cell.disc[place]
                s.candidates.disc[count] = <int>disc
                count += disc > NOBODY
            left += cell.disc[PLACES - 1] < NOBODY
    chains.left = left
    chains.disc = NOBODY
    return count


cdef inline Index gather_chained(State *s, Block block, Chains *chains) noexcept nogil:
    """Round 1 again, for up to a batch of the discs on chains; return how many."""
    cdef Index line, k, last
    cdef Index count = 0
    cdef Index chain = chains.left
    if chains.disc == NOBODY:
        for line in range(block.lines):
            for k in range(3):
                last = s.grid.cells[block.first + line * block.to_line + k * block.to_cell].disc[PLACES - 1]
                if last < NOBODY:
                    chain -= 1
                    if chain == 0:
                        chains.disc = CHAINED - last
    while chains.disc != NOBODY and count < BATCH:
        s.candidates.disc[count] = <int>chains.disc
        count += 1
        chains.disc = s.grid.chain[chains.disc]
    if chains.disc == NOBODY:
        chains.left -= 1
    return count


cdef inline Index keep_approaching(State *s, Index i, Index met, Index count) noexcept nogil:
    """Round 2: keep the discs that approach disc `i`, and how each moves as seen from it; return how many."""
    c = &s.candidates
    cdef Disc a = s.discs[i]
    cdef Index k, j
    cdef Index kept = 0
    cdef int comes, other, free
    for k in range(count):
        j = c.disc[k]
        b = &s.discs[j]
        start = greater(a.time, b.time)
        wait_a = start - a.time
        wait_b = start - b.time
        dx = (b.x + b.vx * wait_b) - (a.x + a.vx * wait_a)
        dy = (b.y + b.vy * wait_b) - (a.y + a.vy * wait_a)
        ux = b.vx - a.vx
        uy = b.vy - a.vy
        c.disc[kept] = <int>j
        c.dx[kept] = dx
        c.dy[kept] = dy
        c.ux[kept] = ux
        c.uy[kept] = uy
        c.reach[kept] = a.radius + b.radius
        c.start[kept] = start
        along = approach(dx, dy, ux, uy)
        comes = not along.value > along.error  # a NaN, where products overflow, is for the error-free form to decide
        other = j != i
        free = j != met
        kept += comes & other & free
    return kept


cdef inline void bound_times(Candidates *c, Index count) noexcept nogil:
    """Round 3: bound the time at which each candidate is met; infinity for never."""
    cdef Index block, lane, k
    cdef int passes, at_rest, apart, deep, closes, never, known
    for block in range((count + LANES - 1) // LANES):
        for lane in range(LANES):  # compilers make vector instructions of this
            k = block * LANES + lane
            b = approach(c.dx[k], c.dy[k], c.ux[k], c.uy[k])
            gap = separation(c.dx[k], c.dy[k], c.reach[k])
            d = discriminant(c.dx[k], c.dy[k], c.ux[k], c.uy[k], c.reach[k])
            passes = d.value < -d.error
            at_rest = fabs(c.ux[k]) + fabs(c.uy[k]) == 0.0
            never = passes | at_rest
            apart = gap.value > CERTAIN * gap.error
            deep = d.value > CERTAIN * d.error
            closes = -b.value > CERTAIN * b.error
            known = apart & deep & closes
            closing = sqrt(d.value if d.value > 0.0 else 0.0) - b.value
            wait = gap.value / (closing if closing > 0.0 else 1.0)
            low = c.start[k] + wait * (1.0 - ROOT_ERROR)
            high = c.start[k] + wait * (1.0 + ROOT_ERROR)
            low = low if known else -INF
            high = high if known else INF
            c.low[k] = INF if never else low
            c.high[k] = INF if never else high


cdef inline Candidate solve_earliest(const State *s, Index i, Index count, Candidate best) noexcept nogil:
    """Return the earliest of the candidates and of `best`, solved to the last digit; of a tie the lower number."""
    c = &s.candidates
    cdef Index k
    latest = best.high
    for k in range(count):
        latest = lesser(c.high[k], latest)
    if best.low < best.high:
        best.low = pair_event_time(s, i, best.partner) if best.low <= latest else INF
    for k in range(count):
        if c.low[k] <= latest:
            time = pair_event_time(s, i, c.disc[k])
            if time < best.low or (time == best.low and c.disc[k] < best.partner):
                best.low = time
                best.partner = c.disc[k]
    return Candidate(best.low, best.low, best.partner)


cdef inline Candidate earliest_of(const State *s, Index i, Index count, Candidate best) noexcept nogil:
    """Round 4: return the earliest of the candidates and of `best`."""
    c = &s.candidates
    cdef Index k, first
    cdef Index at = -1
    least = best.low
    second = INF
    for k in range(count):
        low = c.low[k]
        first = low < least
        at += (k - at) * first
        second = lesser(second, greater(least, low))
        least = lesser(least, low)
    found = Candidate(least, best.high, best.partner)
    if at >= 0:
        found.high = c.high[at]
        found.partner = c.disc[at]
    if unlikely(second <= found.high and least < INF):
        return solve_earliest(s, i, count, best)
    return found


cdef inline Candidate predicted(const Prediction *p) noexcept nogil:
    """Return the impact that is predicted for a disc."""
    high = p.impact_time
    if not p.exact:
        # A lower bound is too low by ROOT_ERROR of the wait at most, or says nothing.
        high = p.impact_time * (1.0 + 4.0 * ROOT_ERROR) if p.impact_time >= 0.0 else INF
    return Candidate(p.impact_time, high, p.partner)


cdef inline void predict_impact(State *s, Index i, Change change) noexcept nogil:
    """Predict the next impact of disc `i` with a disc: of all around, or (OF_CELL) of the predicted and of new ones."""
    cdef Candidate best = Candidate(INF, INF, NOBODY)
    cdef Index met = just_met(s, i)
    cdef Index count, kept, known
    cdef Chains chains
    if change == OF_CELL:
        best = predicted(&s.predictions[i])
        block = new_neighbours(s, i)
    else:
        block = cells_around(s, i)
    known = best.partner
    count = gather(s, block, &chains)
    while True:
        kept = keep_approaching(s, i, met, count)
        bound_times(&s.candidates, kept)
        best = earliest_of(s, i, kept, best)
        if likely(chains.left == 0):
            break
        count = gather_chained(s, block, &chains)
    if change == OF_CELL and best.partner == known:
        return
    p = &s.predictions[i]
    p.impact_time = best.low
    p.exact = best.low == best.high
    p.partner = <int>best.partner
    if best.partner != NOBODY:
        p.partner_impacts = s.discs[best.partner].impacts
