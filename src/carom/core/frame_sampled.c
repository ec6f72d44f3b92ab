/* The frame-sampled loop (PIT): Algorithm 1 for any number of discs.

   The loop skips the frames at which no disc is due, and tests what is due at the others. It loops plainly if that is
   asked for or costs less. */

#include <string.h>

#include "carom/core/pit_tests.h"

size_t carom_pit_lay_out(State *s, char *memory) {
    Arena arena = {memory, 0};
    Index chains = s->has_chains ? s->wall_count : 0;
    s->grid.list_count = count_lists(s);
    s->discs = RESERVE_ROWS(&arena, Disc, s->disc_count);
    s->walls = RESERVE_ROWS(&arena, Wall, s->wall_count);
    s->wall_laws = RESERVE_ROWS(&arena, Law, s->wall_count);
    s->chains = RESERVE_ROWS(&arena, Chain, chains);
    s->edges = RESERVE_ROWS(&arena, ChainEdge, s->edge_count);
    s->normals = RESERVE_ROWS(&arena, Normal, s->has_chains ? s->disc_count : 0);
    s->turning = RESERVE_ROWS(&arena, Turning, s->record.has_spins ? s->disc_count : 1);
    s->due = RESERVE_ROWS(&arena, double, s->disc_count);
    s->due_discs = RESERVE_ROWS(&arena, int, s->disc_count + 1);
    s->grid.first = RESERVE_ROWS(&arena, int, s->grid.list_count);
    s->record.recent = RESERVE_ROWS(&arena, Recent, s->disc_count);
    if (!s->has_chains)
        s->chains = NULL;
    if (memory != NULL)
        memset(memory, 0, arena.used);
    return arena.used;
}

void carom_pit_begin(State *s) {
    s->horizon = MAX_BOUND_FRAMES * (s->clock.step / s->clock.rate);
    for (Index i = 0; i < s->disc_count; i++) {
        Disc *a = &s->discs[i];
        a->cell = NO_CELL;
        a->next = NOBODY;
        a->last = NOBODY;
        s->due[i] = a->inverse_mass == 0.0 ? CAROM_INF : 0.0;
        clear_recent(&s->record.recent[i]);
    }
    for (Index k = 0; k < s->grid.list_count; k++)
        s->grid.first[k] = NOBODY;
    if (s->grid.list_count > 0)
        choose_levels(s);
}

void carom_pit_run(State *s, Index until, Index most) {
    while (s->counts.frames < until && s->work > 0.0 && !s->is_out_of_memory && !s->is_too_far) {
        if (s->row > 0)
            test_all(s);
        else if (s->record.released + s->record.count >= most)
            return;
        else if (loops_plainly(s))
            test_all(s);
        else if (!skip_frames(s, until))
            test_due(s);
    }
}

void carom_pit_write_states(const State *s, double time, double *states) {
    double step = time - s->now;
    for (Index i = 0; i < s->disc_count; i++) {
        const Disc *a = &s->discs[i];
        double *state = &states[4 * i];
        state[0] = a->x;
        state[1] = a->y;
        state[2] = a->vx;
        state[3] = a->vy;
        if (!s->falls) {
            state[0] += a->vx * step;
            state[1] += a->vy * step;
        } else if (step != 0.0 && a->inverse_mass != 0.0) {
            advance_falling(s, state, state + 2, step);
        }
    }
}
