"""The event-driven kernel: takes a run forward from event to event.

Read `layout.pxd` first: the structs, and the words. Then `queue.pxd` (which disc comes next), `grid.pxd`,
`obstacles.pxd` and `exits.pxd` (who is near whom), `scan.pxd` (whom a disc meets), `events.pxd` (what comes next),
`paths.pxd`, `driven.pxd` and `to_and_fro.pxd` (what is driven), `impacts.pxd`, the rooms of `impact/` that all solvers
share, `epochs.pxd`, and here the loop. All of these are inlined here. No result depends on the cells, nor on the pieces
in which a run is taken.
"""

from cython cimport unlikely
from libc.stdint cimport uintptr_t
from libc.stdlib cimport free
from libc.string cimport memcpy

from carom.constants cimport EPOCH_IMPACTS, LOOKS_PER_PREDICTION
from carom.physics.double_double cimport greater
from carom.physics.features cimport FEATURE_NUMBERS, feature_from
from carom.solvers.event_driven.apart cimport carry_out_any, predict_special
from carom.solvers.event_driven.epochs cimport fill_all_cells, new_epoch, next_unpredicted
from carom.solvers.event_driven.events cimport event_time, is_stale, next_event, pair_of
from carom.solvers.event_driven.exits cimport predict_exit
from carom.solvers.event_driven.grid cimport box_of, cell_count, choose_grid, cross_edge, crowding, note_sizes, tile_count
from carom.solvers.event_driven.impacts cimport carry_out_pair, carry_out_wall, reported_time
from carom.solvers.event_driven.layout cimport *
from carom.solvers.event_driven.lookahead cimport *
from carom.solvers.event_driven.memory cimport lay_out
from carom.solvers.event_driven.obstacles cimport find_obstacles
from carom.solvers.event_driven.paths cimport count_legs_anew
from carom.solvers.event_driven.queue cimport earliest, lay_out_queue, runner_up, set_time
from carom.solvers.event_driven.scan cimport predict_impact
from carom.solvers.impact.ambiguity cimport forget
from carom.solvers.impact.law cimport law_of, write_wall_laws
from carom.solvers.impact.record cimport ambiguous_rows, free_record, has_capacity, is_recorded, taken_rows

import numpy as np

from carom.solvers.event_driven.driven import driven_rows

cdef enum:
    # Discs from which memory is fetched early, since their rows no longer fit into a cache: a run of 8,000 takes 1.01 of
    # its time without, one of 16,000 .91, one of 30,000 .78 (a processor with 1 MB of cache to itself).
    AHEAD_FROM = 10_000

cdef Disc _disc
DISC_DTYPE = np.asarray(<Disc[:1]>&_disc).dtype
cdef ToAndFro _to_and_fro
TO_AND_FRO_DTYPE = np.asarray(<ToAndFro[:1]>&_to_and_fro).dtype


#: Called through a pointer: what is called once GCC makes part of the caller, where it would cost all others their speed.
ctypedef void (*Predict)(State *, Index, Change) noexcept nogil
cdef Predict predict_apart = predict_special


cdef inline void predict(State *s, Index i, Change change) noexcept nogil:
    """Predict what has changed of disc `i`'s future, and tell the queue."""
    if change != OF_TIME:
        predict_impact(s, i, change)
        if unlikely(s.looks_apart):
            predict_apart(s, i, change)
        elif change != OF_PARTNER:
            predict_exit(s, i, False)
    set_time(&s.queue, i, event_time(&s.predictions[i]))


#: Called through a pointer: what is called once GCC makes part of the caller.
ctypedef bint (*CarryOut)(State *, Index, Index, double, bint) noexcept nogil
cdef CarryOut carry_out_special = carry_out_any


cdef bint ask(void *asked, int one, int other, bint elastic) noexcept with gil:
    """Ask Python whether the order of impacts on two features matters: at corners, so seldom."""
    return (<object>asked)(one, other, elastic)


cdef bint ask_of_crush(void *asked, int disc) noexcept with gil:
    run = <Kernel>asked
    return run.crushes(run, disc)


cdef Ending take_forward(State *s, double until, Index impacts, Index events) noexcept nogil:
    """Carry out impacts up to `until` (since the start), until there have been `impacts`, or for that many events.

    What is long is called at one place, so that a compiler makes it part of the loop.
    """
    cdef Event event
    cdef Change change
    cdef Index i, ahead
    cdef Index[2] changed  # discs
    cdef bint wanted
    while True:
        if s.counts.at_instant > s.standstill:
            return STANDSTILL
        if events == 0:
            return PAUSE
        events -= 1
        ahead = changed[1] = NOBODY

        # Which event comes next?
        if unlikely(s.counts.predicted < s.disc_count):
            event = Event(START, next_unpredicted(s))
        else:
            i = earliest(&s.queue)
            if not s.queue.time[i] < INF or reported_time(&s.clock, s.queue.time[i]) > until:
                return DONE
            if s.looks_ahead:
                ahead = runner_up(&s.queue, i)
                fetch_disc(s, ahead)
            event = next_event(s, i)
        changed[0] = event.disc

        # What does it do, and of whose future does it change what?
        if event.kind == PAIR_IMPACT or event.kind == WALL_IMPACT:
            time = event_time(&s.predictions[event.disc])
            reported = reported_time(&s.clock, greater(time, s.clock.now))
            if reported > until:
                return DONE
            if s.counts.impacts >= impacts:
                return LIMIT
            wanted = is_recorded(&s.record, reported)
            if unlikely(wanted and not has_capacity(&s.record)):
                return NO_MEMORY
            if event.kind == WALL_IMPACT:
                if unlikely(s.is_special):
                    if not carry_out_special(s, event.disc, -1 - s.predictions[event.disc].obstacle, time, wanted):
                        return s.stopped
                else:
                    carry_out_wall(s, event.disc, s.predictions[event.disc].obstacle, time, wanted, False)
            else:
                pair = pair_of(s, event.disc)
                if unlikely(s.is_special):
                    if not carry_out_special(s, pair.first, pair.second, time, wanted):
                        return s.stopped
                else:
                    carry_out_pair(s, pair.first, pair.second, time, wanted, False)
                changed[0], changed[1] = pair.first, pair.second
                if s.looks_ahead:
                    fetch_neighbours(s, pair.second)
            if unlikely(s.counts.epoch_impacts >= EPOCH_IMPACTS * s.disc_count):
                new_epoch(s)
                continue
            if unlikely(s.counts.beyond - s.grid.beyond > s.grid.beyond_limit):
                return OUTGROWN
            change = OF_PATH
        elif event.kind == CROSSING:
            s.counts.crossings += 1
            cross_edge(s, event.disc)
            change = OF_CELL
            if is_stale(s, event.disc):
                s.counts.stale += 1
                change = OF_PATH
        elif event.kind == STALE:
            s.counts.stale += 1
            change = OF_PARTNER
        else:
            change = OF_PATH if event.kind == START else OF_TIME

        # Predict that anew. A disc that never moves need not look for those that meet it: they see it.
        for i in changed[:2]:
            if i != NOBODY and s.discs[i].inverse_mass > 0.0:
                predict(s, i, change)
                if ahead != NOBODY:
                    fetch_surroundings(s, ahead)
        if ahead != NOBODY:
            fetch_neighbours(s, ahead)
            fetch_partner_cells(s, ahead)


#: Called through a pointer: as part of a Python method, GCC takes the loop for code that seldom runs (12 % of the speed).
ctypedef Ending (*Loop)(State *, double, Index, Index) noexcept nogil
cdef Loop loop = take_forward


cdef class Kernel:
    """A run of the event-driven method: discs and walls, what is predicted of them, and what has been recorded.

    Args:
        start: The discs and walls, `carom.disc_arrays.DiscArrays`: where anything is driven there are features.
        obstacles: What there is to be met of the walls, `carom.solvers.event_driven.obstacles.Obstacles`; None where all
            are half-planes with the coefficients of the law.
        crushes: Called with this kernel and the number of a disc that has gone to and fro for long: whether it is crushed.
        contact_duration: Of the TC model, seconds, 0 for none.
        standstill: Impacts at one instant after which time no longer advances.
        cell_factor: Factor on the width of a cell; infinity for a single one.

    Raises:
        ValueError: There are more discs than can be numbered.
    """

    cdef State s
    cdef object memory
    cdef object recent_memory
    cdef object cells_memory  # of cells chosen since the start
    cdef object decides
    cdef object crushes

    def __cinit__(self, start, obstacles, crushes, double contact_duration, Index standstill, double cell_factor):
        s = &self.s
        cdef Index i
        cdef const double[:, ::1] position = np.ascontiguousarray(start.position_m, np.float64)
        cdef const double[:, ::1] velocity = np.ascontiguousarray(start.velocity_m_s, np.float64)
        cdef const double[::1] radius = np.ascontiguousarray(start.radius_m, np.float64)
        cdef const double[::1] inverse_mass = 1.0 / start.mass_kg
        cdef const double[:, ::1] turning = (
            np.stack([start.spins, 1.0 / start.inertia], axis=1) if start.turns else np.empty((0, 2))
        )
        cdef const double[:, ::1] walls = np.array(() if obstacles else start.walls, np.float64).reshape(-1, 4)
        cdef const double[:, ::1] features = obstacles.rows if obstacles else np.empty((0, FEATURE_NUMBERS))
        cdef const double[:, ::1] driven, legs
        driven, legs = driven_rows(start)
        cdef Index n = radius.shape[0]
        cdef Index length = lay_out_queue(&s.queue, n)
        if length < 0:
            raise ValueError("more discs than can be numbered: at most 8^10")
        s.disc_count = n
        s.wall_count = len(start.walls)
        s.feature_count = features.shape[0]
        s.standstill = standstill
        s.looks_ahead = n >= AHEAD_FROM
        s.record.turns = turning.shape[0] > 0
        s.record.locates = not start.has_half_planes
        s.driving.count = driven.shape[0]
        s.driving.leg_count = legs.shape[0]
        s.looks_apart = s.feature_count > 0 or s.driving.count > 0
        s.is_special = s.record.turns or s.looks_apart
        self.decides, self.crushes = obstacles and obstacles.decides, crushes
        s.record.corners.decides, s.record.corners.asked = ask, <void *>self.decides
        s.crushes, s.asked = ask_of_crush, <void *>self
        s.law = law_of(start, contact_duration)
        found = np.empty(max(1, s.feature_count) * sizeof(Feature), np.uint8)
        cdef unsigned char[::1] found_memory = found
        rows = <Feature *>&found_memory[0]
        for i in range(s.feature_count):
            rows[i] = feature_from(&features[i, 0])
        s.visited = box_of(&position[0, 0], n)
        note_sizes(&s.grid, &radius[0], n, cell_factor)
        # To choose anew costs a prediction a disc, and a look or so a feature.
        s.grid.beyond_limit = <Index>((n + s.feature_count) / (1.0 + s.feature_count / LOOKS_PER_PREDICTION))
        choose_grid(&s.grid, &s.visited, n, <const Wall *>&walls[0, 0], walls.shape[0], rows, s.feature_count)
        # In one piece, for which a system takes large pages where it is large: far fewer to be looked up.
        self.memory = np.empty(lay_out(s, NULL, length) + 64, np.uint8)
        cdef unsigned char[::1] memory = self.memory
        lay_out(s, <char *>((<uintptr_t>&memory[0] + 63) // 64 * 64), length)
        for i in range(n):
            s.discs[i] = Disc(
                position[i, 0], position[i, 1], velocity[i, 0], velocity[i, 1], 0.0, radius[i], inverse_mass[i], 0, NO_BODY
            )
            s.predictions[i] = Prediction(INF, INF, NOBODY, 0, 0, NO_OBSTACLE, LEFT, False)
        for i in range(turning.shape[0]):
            s.turning[i] = Turning(turning[i, 0], turning[i, 1])
        for i in range(n if s.law.contact_duration > 0.0 else 0):
            s.last_impact[i] = -INF
        for i in range(length):
            s.queue.time[i] = INF
        for i in range(s.queue.level[1], length):
            s.queue.holder[i] = 0
        memcpy(s.walls, &walls[0, 0], walls.shape[0] * sizeof(Wall))
        memcpy(s.features, rows, s.feature_count * sizeof(Feature))
        if s.feature_count > 0:
            write_wall_laws(s.wall_laws, &s.law, start)
        self.lay_out_paths(driven, legs)
        if not find_obstacles(s):
            raise MemoryError("no memory for what the cells know of the walls")

    cdef lay_out_paths(self, const double[:, ::1] driven, const double[:, ::1] legs):
        """Fill the rows of what is driven."""
        s = &self.s
        cdef Index i, k, first
        cdef Index leg = 0
        for i in range(s.driving.count):
            row = &s.driving.rows[i]
            row[0] = Driven(<Index>driven[i, 0], leg, <Index>driven[i, 1], 0, 0, 0.0, 0.0, driven[i, 2])
            leg += row.leg_count
            if row.body >= 0:
                row.x, row.y = s.discs[row.body].x, s.discs[row.body].y
            for k in range(s.feature_count if row.body < 0 else 0):
                if s.features[k].wall == -1 - row.body:
                    row.first_feature = row.first_feature if row.feature_count > 0 else k
                    row.feature_count += 1
        for i in range(s.driving.leg_count):
            s.driving.legs[i] = Leg(
                legs[i, 0], legs[i, 1], legs[i, 0], legs[i, 1], legs[i, 2], legs[i, 3], legs[i, 4], legs[i, 5]
            )
        for i in range(s.disc_count if s.to_and_fro != NULL else 0):
            s.to_and_fro[i] = ToAndFro(NO_BODY, NO_OBSTACLE, NO_BODY, NO_OBSTACLE, 0.0, 0.0, 0)

    def __dealloc__(self):
        free_record(&self.s.record)
        free(self.s.grid.lists)

    def run(self, double until, Index impacts, Index events):
        """Call the loop; return how it ended, an `Ending`."""
        cdef Ending ending = OUTGROWN
        while ending == OUTGROWN:
            with nogil:
                ending = loop(&self.s, until, impacts, events)
            if ending == OUTGROWN:
                self.choose_cells_anew()
        if ending == CRUSHED:  # if it is not, as Ctrl-C came first, the discs that struck each other go on from there
            self.s.counts.predicted = 0
        if ending == NO_MEMORY:
            raise MemoryError("no memory for more recorded impacts: record a window of them, or none")
        return ending

    cdef choose_cells_anew(self):
        """Choose the cells for where discs have been, and keep them if that saves more looks than it costs.

        At the rim of a gas that has left the box in which it began all features are looked at. Wider cells, where the box
        has grown by far, hold more discs, nine of them a prediction. What is looked at changes no result.
        """
        s = &self.s
        cdef Grid old = s.grid
        cdef double crowded = crowding(s)
        choose_grid(&s.grid, &s.visited, s.disc_count, NULL, 0, s.features, s.feature_count)
        cells = np.empty(cell_count(&s.grid) * sizeof(Cell) + tile_count(&s.grid) * sizeof(int), np.uint8)
        cdef unsigned char[::1] memory = cells
        s.grid.cells = <Cell *>&memory[0]
        s.grid.list_of = <unsigned int *>(s.grid.cells + cell_count(&s.grid))
        fill_all_cells(s)
        looks = <double>(s.counts.beyond - old.beyond) * s.feature_count / (s.counts.predictions - old.predictions + 1)
        s.grid.lists = NULL
        s.grid.listed = s.grid.list_capacity = 0
        if 9.0 * (crowding(s) - crowded) < looks and find_obstacles(s):
            free(old.lists)
            self.cells_memory = cells
            s.counts.choices += 1
        else:
            free(s.grid.lists)
            s.grid = old
        s.grid.beyond_limit = 2 * old.beyond_limit  # so that all choices cost no more than what they are made to save
        s.grid.predictions, s.grid.beyond = s.counts.predictions, s.counts.beyond
        s.counts.predicted = 0

    def record(self, double begin, double end):
        """Record the impacts from now on that are reported within these times, since the start."""
        r = &self.s.record
        cdef Index i
        self.recent_memory = np.empty(self.s.disc_count * sizeof(Recent), np.uint8)
        cdef unsigned char[::1] recent = self.recent_memory
        r.recent = <Recent *>&recent[0]
        for i in range(self.s.disc_count):
            forget(&r.recent[i])
        r.wanted, r.begin, r.end = True, begin, end

    def take_impacts(self):
        """Return what `taken_rows` does, see record.pxd."""
        return taken_rows(&self.s.record)

    def ambiguous(self):
        """Return the numbers, from the first impact recorded on, of those that are ambiguous."""
        return ambiguous_rows(&self.s.record)

    @property
    def recorded(self):
        """Number of impacts recorded so far."""
        return self.s.record.taken + self.s.record.count

    cdef rows(self, void *begin, size_t size):
        """Return a part of the run's memory, as it is now and will be."""
        cdef const unsigned char[::1] memory = self.memory
        cdef size_t start = <const unsigned char *>begin - &memory[0]
        return self.memory[start:start + size]

    @property
    def discs(self):
        """The rows of all discs, as they are now and will be: an array with the fields of `Disc` in layout.pxd."""
        return self.rows(self.s.discs, self.s.disc_count * sizeof(Disc)).view(DISC_DTYPE)

    @property
    def counts(self):
        """Work so far, by name; `Counts` in layout.pxd says what each is."""
        return self.s.counts

    @property
    def clock(self):
        """Times; `Clock` in layout.pxd says what each is."""
        return self.s.clock

    @property
    def gliding(self):
        """Where the run has ended in `GLIDES`, the disc that does, and the wall along which."""
        return self.s.gliding, self.s.features[self.s.predictions[self.s.gliding].obstacle].wall

    @property
    def nbytes(self):
        """Bytes of the run's memory, recorded impacts left out."""
        chosen = 0 if self.cells_memory is None else self.cells_memory.nbytes
        return self.memory.nbytes + chosen + self.s.grid.list_capacity * sizeof(int)

    cdef last_impacts(self):
        """Return the times of each disc's last impact, where the TC model asks for them, else nothing."""
        cdef size_t size = self.s.disc_count * sizeof(double) if self.s.law.contact_duration > 0.0 else 0
        return self.rows(self.s.last_impact, size)

    @property
    def spins(self):
        """Spins of all discs, as they are now and will be; None if no disc spins."""
        size = self.s.disc_count * sizeof(Turning)
        return self.rows(self.s.turning, size).view(np.float64)[::2] if self.s.record.turns else None

    @property
    def to_and_fro(self):
        """How each disc goes to and fro: an array with the fields of `ToAndFro` in layout.pxd; None if no body is driven."""
        size = self.s.disc_count * sizeof(ToAndFro)
        return None if self.s.to_and_fro == NULL else self.rows(self.s.to_and_fro, size).view(TO_AND_FRO_DTYPE)

    def state(self):
        """Return a copy of all that the run needs to go on, by name: what is predicted is rebuilt."""
        recent = self.recent_memory.copy() if self.s.record.wanted else None
        return {
            "discs": self.discs.copy(), "last_impacts": self.last_impacts().copy(), "recent": recent,
            "clock": self.s.clock, "counts": self.s.counts,
            "spins": self.spins.copy() if self.s.record.turns else None,
            "to_and_fro": None if self.s.to_and_fro == NULL else self.to_and_fro.copy(),
        }

    def resume(self, state):
        """Take up a run of the same discs and walls, with a contact duration if this one has one, where it was left."""
        self.discs[:] = state["discs"]
        last_impacts = self.last_impacts()
        last_impacts[:] = state["last_impacts"][:len(last_impacts)]
        if self.s.record.wanted and state["recent"] is not None:
            self.recent_memory[:] = state["recent"]
        if self.s.record.turns:
            self.spins[:] = state["spins"]
        if self.s.to_and_fro != NULL:
            self.to_and_fro[:] = state["to_and_fro"]
        self.s.clock, self.s.counts = state["clock"], state["counts"]
        count_legs_anew(&self.s)
        self.s.counts.predicted = 0
        self.s.grid.predictions, self.s.grid.beyond = self.s.counts.predictions, self.s.counts.beyond
