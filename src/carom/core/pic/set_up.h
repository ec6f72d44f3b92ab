/* Set-up of a run of PIC: memory layout, and functions that fill the memory from a `RunInput`. */

#pragma once

#include "carom/core/pic/event_queue.h"
#include "carom/core/pic/obstacle_lists.h"

/* ---- sizes ---- */

/* Set the addresses of all arrays of a run in the block `memory`, and return their total size in bytes. If `memory` is
   NULL, only the returned size is meaningful. */
static inline size_t lay_out(State *s, void *memory) {
    Arena arena = {memory, 0};
    Index discs = s->disc_count;
    /* number of times on level 0, where no holders are stored, because time i belongs to disc i */
    Index times_below = s->queue.level[1];
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
        /* the array of holders begins with level 1; after this shift, a time and its holder (a disc) have the same
           index */
        s->queue.holder -= times_below;
    return arena.used;
}

/* Return an upper bound of the absolute coordinates of all obstacles. */
static inline double obstacle_extent(const RunInput *input) {
    double extent = 0.0;
    for (Index k = 0; k < input->wall_count && input->walls != NULL; k++) {
        const double *row = input->walls + WALL_NUMBERS * k;
        Wall wall = {row[0], row[1], row[2], row[3]};
        extent = greater(extent, wall_extent(&wall));
    }
    for (Index k = 0; k < input->feature_count; k++) {
        Feature feature = feature_from(input->features + FEATURE_NUMBERS * k);
        extent = greater(extent, feature_extent(&feature));
    }
    return extent;
}

/* If discs accelerate, set gravity, table deceleration and rolling resistance. */
static inline void set_acceleration(State *s, const RunInput *input) {
    Accelerated *run = &s->accelerated;
    s->has_acceleration = input->has_acceleration;
    if (input->has_acceleration) {
        run->gx = input->gravity[0];
        run->gy = input->gravity[1];
        run->deceleration = input->deceleration;
        run->rolling_resistance = input->rolling_resistance;
        run->never_length = input->never_length;
        run->exact = input->exact;
    }
}

/* ---- rows ---- */

static inline void fill_discs(State *s, const RunInput *input) {
    for (Index i = 0; i < s->disc_count; i++) {
        s->discs[i] = (Disc){
            .x = input->position[2 * i],
            .y = input->position[2 * i + 1],
            .vx = input->velocity[2 * i],
            .vy = input->velocity[2 * i + 1],
            .radius = input->radius[i],
            .inverse_mass = 1.0 / input->mass[i],
            .last = NO_BODY,
        };
        s->predictions[i] = (Prediction){CAROM_INF, CAROM_INF, NOBODY, 0, 0, NO_OBSTACLE, LEFT, false};
        if (s->turning != NULL)
            s->turning[i] = (Turning){input->spin[i], 1.0 / input->inertia[i]};
        if (s->law.contact_duration > 0.0)
            s->last_impact[i] = -CAROM_INF;
        if (s->to_and_fro != NULL)
            s->to_and_fro[i] = (ToAndFro){NO_BODY, NO_OBSTACLE, NO_BODY, NO_OBSTACLE, 0.0, 0.0, 0};
    }
}

/* The rows of discs, features and driven bodies must have been filled before. */
static inline void fill_acceleration(State *s, const RunInput *input) {
    Accelerated *run = &s->accelerated;
    for (Index i = 0; i < s->disc_count; i++) {
        bool moves = s->discs[i].inverse_mass > 0.0;
        run->paths[i] = (Parabola){
            .ax = moves ? run->gx : 0.0,
            .ay = moves ? run->gy : 0.0,
            .ends = NEVER,
            .ground = NO_OBSTACLE,
            .never_of = NO_OBSTACLE,
            .never_but = NO_OBSTACLE,
            .left_ground = NO_OBSTACLE,
            .corner = NO_BODY,
            .corner_ground = NO_OBSTACLE,
        };
        if (run->deceleration > 0.0)
            slow_down(s, i);
        clear_recent(&s->record.recent[i]);
    }
    int never = 0;
    for (Index k = 0; k < s->feature_count; k++) {
        const double *row = input->grounds + GROUND_NUMBERS * k;
        int never_count = (int)row[3];
        const Feature *f = &s->features[k];
        double h = f->kind == FACE ? f->half_width : 0.0;
        run->grounds[k] = (Ground){
            .x = f->x.high + h * f->nx,
            .y = f->y.high + h * f->ny,
            .over = {(int)row[1], (int)row[2]},
            .never_first = never,
            .never_count = never_count,
            .is_ground = row[0] != 0.0,
        };
        never += never_count;
    }
    for (Index k = 0; k < run->never_length; k++)
        run->never_lists[k] = (int)input->never_lists[k];
}

static inline void fill_obstacles(State *s, const RunInput *input) {
    for (Index k = 0; k < s->wall_count && input->walls != NULL; k++) {
        const double *row = input->walls + WALL_NUMBERS * k;
        s->walls[k] = (Wall){row[0], row[1], row[2], row[3]};
    }
    for (Index k = 0; k < s->feature_count; k++)
        s->features[k] = feature_from(input->features + FEATURE_NUMBERS * k);
    if (s->feature_count > 0)
        write_wall_laws(s->wall_laws, input);
}

static inline void fill_driving(State *s, const RunInput *input) {
    Index first_leg = 0;
    for (Index i = 0; i < s->driving.count; i++) {
        const double *numbers = input->driven + DRIVEN_NUMBERS * i;
        Driven *row = &s->driving.rows[i];
        *row = (Driven){
            .body = (Index)numbers[0], .first_leg = first_leg, .leg_count = (Index)numbers[1], .belt = numbers[2]
        };
        first_leg += row->leg_count;
        if (row->body >= 0) {
            row->x = s->discs[row->body].x;
            row->y = s->discs[row->body].y;
            continue;
        }
        for (Index k = 0; k < s->feature_count; k++) {
            if (s->features[k].wall == -1 - row->body) {
                row->first_feature = row->feature_count > 0 ? row->first_feature : k;
                row->feature_count += 1;
            }
        }
    }
    for (Index i = 0; i < s->driving.leg_count; i++)
        s->driving.legs[i] = leg_of(input, i);
}
