/* Event-driven loop (PIC), and the functions that bindings call.

   Read `pic/state.h` first. Results do not depend on the cells, on prefetching, or on the number of calls that advance
   a run. */

#include "carom/core/pic/all_pairs.h"
#include "carom/core/pic/clock.h"
#include "carom/core/pic/driven_impact.h"
#include "carom/core/pic/event_queue.h"
#include "carom/core/pic/few_bodies.h"
#include "carom/core/pic/next_event.h"
#include "carom/core/pic/obstacle_lists.h"
#include "carom/core/pic/prefetch.h"
#include "carom/core/pic/set_up.h"
#include "carom/core/pic/straight_impact.h"
#include "carom/core/pic/straight_partner.h"

/* ---- the loop ---- */

typedef struct Changed {
    Index disc[2]; /* numbers of the changed discs; NOBODY in an unused place */
    Change change; /* which predictions of the changed discs must be computed again */
} Changed;

/* Predict the next events of disc `i` that `change` affects, and update the queue. */
static inline void predict(State *s, Index i, Change change) {
    if (change != OF_TIME) {
        if (CAROM_UNLIKELY(s->accelerated.paths != NULL)) {
            predict_accelerated(s, i, change);
        } else {
            predict_partner(s, i, change);
            if (CAROM_UNLIKELY(s->has_special_paths))
                predict_special(s, i, change);
            else if (change != OF_PARTNER)
                predict_exit(s, i, false);
        }
    }
    set_time(&s->queue, i, event_time(&s->predictions[i]));
}

/* If discs accelerate, apply an impact or the end of a motion; otherwise `apply_impact` is used. The event's instant is
   the sum of a high and a low part. */
static CAROM_NOINLINE Ending apply_accelerated_event(State *s, Event event, double until, Index impacts,
                                                     Changed *changed) {
    const Prediction *p = &s->predictions[event.disc];
    Instant at = later_of((Instant){event_time(p), event_low(s, event)}, now_instant(s));
    bool is_wanted;
    Ending ending = check_limits(s, at, until, impacts, &is_wanted);
    if (ending != NOT_ENDED)
        return ending;
    Bodies bodies = event.kind == MOTION_ENDS ? (Bodies){event.disc, event.disc} : bodies_of(s, event);
    if (event.kind == PAIR_IMPACT) {
        changed->disc[0] = bodies.first;
        changed->disc[1] = bodies.second;
    }
    changed->change = OF_PATH;
    if (!apply_accelerated(s, bodies.first, bodies.second, at, is_wanted))
        return s->stopped;
    return s->counts.beyond - s->grid.beyond > s->grid.beyond_limit ? OUTGROWN : NOT_ENDED;
}

/* Apply an impact, unless it is beyond `until` or `impacts`, the limits of this call of `carom_advance`. Return the
   `Ending` if the impact or a limit ends the call. If nothing ends the call, return NOT_ENDED. */
static inline Ending apply_impact(State *s, Event event, double until, Index impacts, Changed *changed) {
    double time = event_time(&s->predictions[event.disc]);
    bool is_wanted;
    Ending ending = check_limits(s, (Instant){greater(time, s->clock.now), 0.0}, until, impacts, &is_wanted);
    if (CAROM_UNLIKELY(ending != NOT_ENDED))
        return ending;
    if (event.kind == WALL_IMPACT) {
        Index obstacle = s->predictions[event.disc].obstacle;
        if (CAROM_UNLIKELY(s->has_special_impacts)) {
            if (!apply_special_impact(s, event.disc, -1 - obstacle, time, is_wanted))
                return s->stopped;
        } else {
            apply_wall_impact(s, event.disc, obstacle, time, is_wanted, false);
        }
    } else {
        Bodies pair = pair_of(s, event.disc);
        if (CAROM_UNLIKELY(s->has_special_impacts)) {
            if (!apply_special_impact(s, pair.first, pair.second, time, is_wanted))
                return s->stopped;
        } else {
            apply_pair_impact(s, pair.first, pair.second, time, is_wanted, false);
        }
        changed->disc[0] = pair.first;
        changed->disc[1] = pair.second;
        if (s->needs_prefetch)
            prefetch_neighbours(s, pair.second);
    }
    changed->change = OF_PATH;
    if (CAROM_UNLIKELY(s->counts.epoch_impacts >= CAROM_EPOCH_IMPACTS * s->disc_count)) {
        begin_epoch(s);
        changed->disc[0] = changed->disc[1] = NOBODY; /* START events will predict all discs */
    } else if (CAROM_UNLIKELY(s->counts.beyond - s->grid.beyond > s->grid.beyond_limit)) {
        return OUTGROWN;
    }
    return NOT_ENDED;
}

/* Apply an event that changes only predictions. Return which predictions of the event's disc must be computed again. */
static inline Change apply_other_event(State *s, Event event) {
    if (event.kind == CROSSING) {
        s->counts.crossings += 1;
        cross_edge(s, event.disc);
        if (!is_stale(s, event.disc))
            return OF_CELL;
        s->counts.stale += 1;
        return OF_PATH;
    }
    if (event.kind == STALE) {
        s->counts.stale += 1;
        return OF_PARTNER;
    }
    return event.kind == START ? OF_PATH : OF_TIME;
}

/* Advance a run like `carom_advance`, but also return OUTGROWN if discs have moved outside the grid of cells. Each long
   function is called in only one place, so that compilers inline it. */
static CAROM_NOINLINE Ending advance(State *s, double until, Index impacts, Index events) {
    while (true) {
        if (s->counts.at_instant > s->standstill)
            return STANDSTILL;
        if (events-- == 0)
            return PAUSE;

        Event event = {START, NOBODY};
        Index ahead = NOBODY;
        if (CAROM_UNLIKELY(s->counts.predicted < s->disc_count)) {
            event.disc = next_unpredicted(s);
        } else {
            Index i = earliest(&s->queue);
            if (!(s->queue.time[i] < CAROM_INF) || reported_time(&s->clock, s->queue.time[i]) > until)
                return DONE;
            if (s->needs_prefetch) {
                ahead = runner_up(&s->queue, i);
                prefetch_disc(s, ahead);
            }
            event = next_event(s, i);
        }

        Changed changed = {{event.disc, NOBODY}, OF_PATH};
        if (event.kind == PAIR_IMPACT || event.kind == WALL_IMPACT || event.kind == MOTION_ENDS) {
            Ending ending = CAROM_UNLIKELY(s->accelerated.paths != NULL)
                                ? apply_accelerated_event(s, event, until, impacts, &changed)
                                : apply_impact(s, event, until, impacts, &changed);
            if (CAROM_UNLIKELY(ending != NOT_ENDED))
                return ending;
        } else {
            changed.change = apply_other_event(s, event);
        }

        /* A disc that never moves has no predictions, because the predictions of other discs contain its impacts. */
        for (const Index *i = changed.disc; i < changed.disc + 2; i++) {
            if (*i != NOBODY && s->discs[*i].inverse_mass > 0.0) {
                predict(s, *i, changed.change);
                if (ahead != NOBODY)
                    prefetch_surroundings(s, ahead);
            }
        }
        if (ahead != NOBODY) {
            prefetch_neighbours(s, ahead);
            prefetch_partner_cells(s, ahead);
        }
    }
}

/* Choose new cells for the region where discs have been. Keep the new cells only if they save more checks of features
   than they cost.

   Outside the area in which lists of obstacles are valid, every disc must be checked against all features. A grid of
   larger cells covers a larger area. But larger cells contain more discs, and a prediction searches nine cells. The
   choice of cells does not change results. */
static void choose_cells_again(State *s) {
    Grid *g = &s->grid;
    Grid old = *g;
    double old_occupancy = mean_occupancy(s);
    choose_grid(g, &s->visited, s->disc_count, s->feature_count);
    size_t cells_size = (size_t)cell_count(g) * sizeof(Cell);
    g->own_size = cells_size + (size_t)tile_count(g) * sizeof(unsigned int);
    g->own_memory = s->resize(NULL, 0, g->own_size);
    g->lists = NULL;
    g->listed = g->list_capacity = 0;
    bool is_better = false;
    if (g->own_memory != NULL) {
        g->cells = g->own_memory;
        g->list_of = (unsigned int *)((char *)g->own_memory + cells_size);
        fill_cells(s);
        double checks = (double)(s->counts.beyond - old.beyond) * (double)s->feature_count /
                        (double)(s->counts.predictions - old.predictions + 1);
        is_better = 9.0 * (mean_occupancy(s) - old_occupancy) < checks && list_obstacles(s);
    }
    const Grid *unused = is_better ? &old : g;
    if (unused->lists != NULL)
        s->resize(unused->lists, 0, 0);
    if (unused->own_memory != NULL)
        s->resize(unused->own_memory, 0, 0);
    if (!is_better)
        *g = old;
    s->counts.choices += is_better;
    /* doubling the limit keeps the total cost of new cells below their savings */
    g->beyond_limit = 2 * old.beyond_limit;
    g->predictions = s->counts.predictions;
    g->beyond = s->counts.beyond;
    s->counts.predicted = 0;
}

Ending carom_advance(State *s, double until, Index impacts, Index events) {
    if (s->accelerated.paths != NULL && !s->counts.has_begun && !begin_contacts(s))
        return NO_MEMORY;
    s->until = greater(s->until, until);
    if (s->solves_all_pairs)
        return advance_all_pairs(s, until, impacts, events);
    if (s->has_few_bodies)
        return advance_few(s, until, impacts, events);
    Ending ending = advance(s, until, impacts, events);
    while (ending == OUTGROWN) {
        choose_cells_again(s);
        ending = advance(s, until, impacts, events);
    }
    return ending;
}

/* ---- functions for bindings ---- */

/* Return whether the loop for few bodies (few_bodies.h) advances a run. The result is false if the caller sets a factor
   for the width of cells, because this loop uses no cells. */
static bool has_few_bodies(const State *s, const RunInput *input) {
    bool has_few = s->disc_count <= MOST_FEW_DISCS && s->wall_count <= MOST_FEW_WALLS;
    bool is_plain = !s->has_special_impacts && !s->has_acceleration && !s->has_touched;
    return has_few && is_plain && input->cell_factor == 1.0;
}

size_t carom_set_up(State *s, const RunInput *input) {
    memset(s, 0, sizeof(State));
    Index n = input->disc_count;
    if (!lay_out_queue(&s->queue, n) || input->wall_count > MOST_OBSTACLES || input->feature_count > MOST_OBSTACLES)
        return 0;
    s->disc_count = n;
    s->wall_count = input->wall_count;
    s->feature_count = input->feature_count;
    s->driving.count = input->driven_count;
    s->driving.leg_count = input->leg_count;
    s->standstill = input->standstill;
    s->needs_prefetch = n >= PREFETCH_FROM;
    s->law = input->law;
    s->record.has_spins = input->has_spins;
    s->record.has_contacts = input->has_finite_walls;
    s->record.corners = input->corners;
    s->record.resize = s->resize = input->resize;
    s->until = input->until;
    s->solves_all_pairs = input->solves_all_pairs;
    set_acceleration(s, input);
    s->has_touched = has_inelastic_body(input);
    s->has_special_paths = s->feature_count > 0 || s->driving.count > 0;
    s->has_special_impacts = s->has_special_paths || s->record.has_spins;
    s->has_few_bodies = has_few_bodies(s, input);
    s->visited = box_around(input->position, n);
    set_sizes(&s->grid, input->radius, n, input->cell_factor);
    s->grid.extent = obstacle_extent(input);
    choose_grid(&s->grid, &s->visited, n, s->feature_count);
    /* Choosing new cells costs about as much as one prediction per disc and one check per feature. The limit is the
       number of predictions outside the area of the lists that together cost as much. Each prediction outside this area
       checks all features. */
    double checks = (double)(n + s->feature_count) / (1.0 + (double)s->feature_count / CAROM_LOOKS_PER_PREDICTION);
    s->grid.beyond_limit = (Index)checks;
    return lay_out(s, NULL);
}

bool carom_begin(State *s, const RunInput *input, void *memory) {
    lay_out(s, memory);
    fill_discs(s, input);
    fill_obstacles(s, input);
    fill_driving(s, input);
    if (s->has_acceleration)
        fill_acceleration(s, input);
    if (s->has_few_bodies)
        fill_few_bodies(s);
    for (Index i = 0; i < s->disc_count && s->touched != NULL; i++)
        s->touched[i].count = 0;
    for (Index i = 0; i < queue_length(&s->queue); i++)
        s->queue.time[i] = CAROM_INF;
    for (Index i = s->queue.level[1]; i < queue_length(&s->queue); i++)
        s->queue.holder[i] = 0;
    return list_obstacles(s);
}

void carom_record(State *s, Recent *recent, double begin, double end) {
    /* if discs accelerate, `record.recent` already has memory in the arena, because ambiguous impacts are then counted
       even if no impact is recorded */
    if (!s->has_acceleration) {
        for (Index i = 0; i < s->disc_count; i++)
            clear_recent(&recent[i]);
        s->record.recent = recent;
    }
    s->record.is_wanted = true;
    s->record.begin = begin;
    s->record.end = end;
}

void carom_resume(State *s) {
    count_legs_from_epoch(s);
    s->counts.predicted = 0;
    s->grid.predictions = s->counts.predictions;
    s->grid.beyond = s->counts.beyond;
}

void carom_states(const State *s, double time, double time_low, double *states) {
    for (Index i = 0; i < s->disc_count; i++) {
        Motion there = disc_motion(s, i, (Instant){time, time_low});
        memcpy(states + 4 * i, (double[]){there.x, there.y, there.vx, there.vy}, 4 * sizeof(double));
    }
}

void carom_spins(const State *s, double time, double time_low, double *spins) {
    for (Index i = 0; i < s->disc_count; i++)
        spins[i] = s->accelerated.paths == NULL ? s->turning[i].spin : spin_at(s, i, (Instant){time, time_low});
}

void carom_impact_counts(const State *s, int64_t *counts) {
    for (Index i = 0; i < s->disc_count; i++)
        counts[i] = s->discs[i].impacts - (s->accelerated.paths == NULL ? 0 : s->accelerated.paths[i].changes);
}

Index carom_gliding_wall(const State *s) {
    return s->features[s->predictions[s->gliding].obstacle].wall;
}

size_t carom_allocated(const State *s) {
    return s->grid.own_size + (size_t)s->grid.list_capacity * sizeof(int);
}

void carom_release(State *s) {
    if (s->grid.lists != NULL)
        s->resize(s->grid.lists, 0, 0);
    if (s->grid.own_memory != NULL)
        s->resize(s->grid.own_memory, 0, 0);
    s->grid.lists = NULL;
    s->grid.own_memory = NULL;
}
