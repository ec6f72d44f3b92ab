/* Recorded changes of mode: when discs begin to slide, roll or rest on a wall, and when they leave it. */

#pragma once

#include "carom/core/record.h"
#include "carom/core/state.h"

/* Make room for the changes that one event can make: one for each of two discs. Return whether there is any. */
static inline bool reserve_modes(State *s) {
    Accelerated *run = &s->accelerated;
    if (run->mode_count + 2 > run->mode_capacity) {
        Index capacity = 2 * run->mode_capacity + 64;
        ModeRow *modes = s->resize(run->modes, (size_t)run->mode_count * sizeof(ModeRow), (size_t)capacity * sizeof(ModeRow));
        if (modes == NULL) {
            return false;
        }
        run->modes = modes;
        run->mode_capacity = capacity;
    }
    return true;
}

/* Record a change of mode at the reported time, if that is wanted. */
static inline void record_mode(State *s, const ModeRow *row) {
    Accelerated *run = &s->accelerated;
    if (is_recorded(&s->record, s->clock.reported)) {
        run->modes[run->mode_count] = *row;
        run->modes[run->mode_count].time = s->clock.reported;
        run->modes[run->mode_count].impacts = s->record.released + s->record.count;
        run->mode_count += 1;
    }
}
