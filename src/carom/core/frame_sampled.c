/* The frame-sampled loop (PIT): Algorithm 1 for any number of discs.

   The loop skips the frames at which no disc is due, and tests what is due at the others. If that costs more than it
   saves, it makes all tests of a frame that can find something, by a sweep. It loops plainly if that is asked for, and
   for a few discs, for which it costs less. */

#include <string.h>

#include "carom/core/pit_sweep.h"
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
    s->hits = RESERVE_ROWS(&arena, ChainHit, s->has_chains ? s->disc_count : 0);
    s->touched = RESERVE_ROWS(&arena, TouchedBodies, s->has_touched ? s->disc_count : 0);
    s->slowing = RESERVE_ROWS(&arena, Slowing, s->motion == SLOWING ? s->disc_count : 0);
    s->paths = RESERVE_ROWS(&arena, Path, s->path_count);
    s->legs = RESERVE_ROWS(&arena, Leg, s->leg_count);
    s->disc_paths = RESERVE_ROWS(&arena, int, s->has_driven_discs ? s->disc_count : 0);
    s->wall_motions = RESERVE_ROWS(&arena, WallMotion, s->has_wall_motions ? s->wall_count : 0);
    s->turning = RESERVE_ROWS(&arena, Turning, s->record.has_spins ? s->disc_count : 1);
    s->searches = RESERVE_ROWS(&arena, Search, s->disc_count);
    s->clearances = RESERVE_ROWS(&arena, Clearance, s->disc_count);
    s->stale_discs = RESERVE_ROWS(&arena, int, s->disc_count);
    s->due = RESERVE_ROWS(&arena, double, s->disc_count);
    s->due_discs = RESERVE_ROWS(&arena, int, s->disc_count + 1);
    s->grid.first = RESERVE_ROWS(&arena, int, s->grid.list_count);
    s->grid.swept = RESERVE_ROWS(&arena, int, s->grid.list_count);
    s->grid.swept_next = RESERVE_ROWS(&arena, int, s->grid.list_count > 0 ? s->disc_count : 0);
    s->record.recent = RESERVE_ROWS(&arena, Recent, s->disc_count);
    if (!s->has_chains)
        s->chains = NULL;
    if (!s->has_driven_discs)
        s->disc_paths = NULL;
    if (!s->has_wall_motions)
        s->wall_motions = NULL;
    if (!s->has_touched)
        s->touched = NULL;
    if (memory != NULL)
        memset(memory, 0, arena.used);
    return arena.used;
}

void carom_pit_begin(State *s) {
    begin_bounds(s);
    for (Index i = 0; i < s->disc_count; i++) {
        Disc *a = &s->discs[i];
        a->cell = NO_CELL;
        a->next = NOBODY;
        a->last = NOBODY;
        s->due[i] = a->inverse_mass == 0.0 && disc_path(s, i) == NULL ? CAROM_INF : 0.0;
        clear_recent(&s->record.recent[i]);
        s->clearances[i].gap = -CAROM_INF;
        if (s->motion == SLOWING) {
            s->slowing[i] = (Slowing){0.0, 0.0, NEVER};
            slow_disc(s, i);
        }
    }
    for (Index k = 0; k < s->wall_count; k++) {
        const Wall *wall = &s->walls[k];
        for (Index n = 0; is_chain(s, k) && n < s->chains[k].edge_count; n++)
            enclose_edge(&s->chains[k].edges[n]);
        double size = is_chain(s, k) ? s->chains[k].size : fabs(wall->x) + fabs(wall->y);
        s->wall_size = greater(size, s->wall_size);
    }
    for (Index k = 0; k < s->grid.list_count; k++)
        s->grid.first[k] = NOBODY;
    if (CAROM_SKIPS && s->grid.list_count > 0)
        choose_levels(s);
}

void carom_pit_run(State *s, Index until, Index most) {
    while (s->counts.frames < until && s->work > 0.0 && !s->is_out_of_memory && !s->is_too_far) {
        if (s->row > 0)
            test_all(s);
        else if (s->record.released + s->record.count >= most)
            return;
        else if (loops_plainly(s) && (!CAROM_SKIPS || s->grid.list_count == 0))
            test_all(s);
        else if (loops_plainly(s))
            sweep_frame(s);
        else if (!skip_frames(s, until))
            test_due(s);
    }
}

void carom_pit_write_states(const State *s, double time, double *states) {
    double step = time - s->now;
    for (Index i = 0; i < s->disc_count; i++) {
        const Disc *a = &s->discs[i];
        const Path *path = disc_path(s, i);
        double *centre = &states[4 * i];
        double *velocity = centre + 2;
        centre[0] = a->x;
        centre[1] = a->y;
        velocity[0] = a->vx;
        velocity[1] = a->vy;
        if (path != NULL) {
            write_driven(path, &path->legs[leg_at(path, time, path->leg)], time, centre, velocity);
        } else if (s->motion == STRAIGHT) {
            centre[0] += a->vx * step;
            centre[1] += a->vy * step;
        } else if (step != 0.0 && a->inverse_mass != 0.0) {
            if (s->motion == FALLING) {
                advance_falling(s, centre, velocity, step);
            } else {
                Slowing slowing = s->slowing[i];
                advance_slowing(centre, velocity, &slowing, s->now, time);
            }
        }
    }
}
