/* Memory of an event-driven run: one arena contains all rows whose number is fixed. */

#pragma once

#include "carom/core/arena.h"
#include "carom/core/pic/event_queue.h"
#include "carom/core/pic/grid.h"
#include "carom/core/pic/state.h"

/* Place all rows of a run, and return their size in bytes. With `memory` NULL only the size is computed. */
static inline size_t lay_out(State *s, void *memory) {
    Arena arena = {memory, 0};
    Index discs = s->disc_count;
    Index times_below = s->queue.level[1]; /* level 0 has times, but no holders */
    bool has_paths = s->driving.leg_count > 0;
    s->discs = RESERVE_ROWS(&arena, Disc, discs);
    s->predictions = RESERVE_ROWS(&arena, Prediction, discs);
    s->queue.time = RESERVE_ROWS(&arena, double, queue_length(&s->queue));
    s->queue.holder = RESERVE_ROWS(&arena, int, queue_length(&s->queue) - times_below);
    s->grid.cells = RESERVE_ROWS(&arena, Cell, cell_count(&s->grid));
    s->grid.chain = RESERVE_ROWS(&arena, int, discs);
    s->grid.list_of = RESERVE_ROWS(&arena, unsigned int, tile_count(&s->grid));
    s->walls = RESERVE_ROWS(&arena, Wall, s->wall_count);
    s->features = RESERVE_ROWS(&arena, Feature, s->feature_count);
    s->driving.rows = RESERVE_ROWS(&arena, Driven, s->driving.count);
    s->driving.legs = RESERVE_ROWS(&arena, Leg, s->driving.leg_count);
    s->to_and_fro = has_paths ? RESERVE_ROWS(&arena, ToAndFro, discs) : NULL;
    s->wall_laws = RESERVE_ROWS(&arena, Law, s->feature_count > 0 ? s->wall_count : 0);
    s->last_impact = RESERVE_ROWS(&arena, double, s->law.contact_duration > 0.0 ? discs : 0);
    bool accelerates = s->has_acceleration;
    Accelerated *run = &s->accelerated;
    run->paths = accelerates ? RESERVE_ROWS(&arena, Parabola, discs) : NULL;
    run->grounds = accelerates ? RESERVE_ROWS(&arena, Ground, s->feature_count) : NULL;
    run->never_lists = accelerates ? RESERVE_ROWS(&arena, int, run->never_length) : NULL;
    s->record.recent = accelerates ? RESERVE_ROWS(&arena, Recent, discs) : s->record.recent;
    s->touched = s->has_touched ? RESERVE_ROWS(&arena, TouchedBodies, discs) : NULL;
    s->turning = s->record.has_spins || accelerates ? RESERVE_ROWS(&arena, Turning, discs) : NULL;
    if (memory != NULL)
        s->queue.holder -= times_below; /* so that a time and its holder have the same index */
    return arena.used;
}
