/* Binding of the frame-sampled loop, and of damped times, for JavaScript.

   The loop is included, so that both use one copy of the exponentials. */

#include "carom/core/damping.h"
#include "carom/core/frame_sampled.c"
#include "carom/core/wasm/input.h"

static State state;

/* ---- damping ---- */

CAROM_EXPORT("kept") double kept(double rate, double time) {
    return remaining_velocity(rate, time);
}

CAROM_EXPORT("undamped") double undamped(double rate, double time) {
    return undamped_time(rate, time);
}

CAROM_EXPORT("damped") double damped(double rate, double time) {
    return damped_time(rate, time);
}

CAROM_EXPORT("latest_undamped") double latest_undamped(double rate, double time) {
    return latest_undamped_time(rate, time);
}

static void write_discs(void) {
    double *const *arrays = carom_input.arrays;
    for (Index i = 0; i < state.disc_count; i++) {
        Disc *a = &state.discs[i];
        a->x = arrays[POSITIONS][2 * i];
        a->y = arrays[POSITIONS][2 * i + 1];
        a->vx = arrays[VELOCITIES][2 * i];
        a->vy = arrays[VELOCITIES][2 * i + 1];
        a->radius = arrays[RADII][i];
        a->inverse_mass = 1.0 / arrays[MASSES][i];
        if (state.record.has_spins)
            state.turning[i] = (Turning){arrays[SPINS][i], 1.0 / arrays[INERTIAS][i]};
    }
}

enum { CHAIN_NUMBERS = 7, EDGE_NUMBERS = 10 };

static ChainEdge edge_from(const double *row) {
    return (ChainEdge){row[0], row[1], row[2], row[3], row[4], row[5], row[6], row[7], row[8] != 0.0, row[9] != 0.0};
}

static void write_walls(void) {
    ChainEdge *edge = state.edges;
    const double *row = carom_input.arrays[EDGE_ROWS];
    for (Index k = 0; k < state.wall_count; k++) {
        const double *wall = carom_input.arrays[CHAIN_ROWS] + CHAIN_NUMBERS * k;
        const double *material = carom_input.arrays[MATERIALS] + 2 * k;
        state.wall_laws[k] = state.law;
        state.wall_laws[k].wall_restitution = material[0];
        state.wall_laws[k].wall_contact.friction = material[1];
        Index count = (Index)wall[0];
        if (count == 0) {
            state.walls[k] = (Wall){wall[3], wall[4], wall[5], wall[6]};
            continue;
        }
        state.chains[k] = (Chain){edge, count, wall[1], wall[2]};
        for (Index n = 0; n < count; n++, row += EDGE_NUMBERS)
            *edge++ = edge_from(row);
    }
}

/* ---- driven bodies ---- */

enum { DRIVEN_NUMBERS = 3, LEG_NUMBERS = 6 }; /* of rows: see `RunInput` in state.h */

static Index driven_count(void) {
    return carom_input.lengths[DRIVEN] / DRIVEN_NUMBERS;
}

static const double *driven_row(Index k) {
    return carom_input.arrays[DRIVEN] + DRIVEN_NUMBERS * k;
}

/* Set the numbers of paths and legs, and what moves. A driven body without legs stands, or only its surface moves. */
static void count_paths(void) {
    state.leg_count = carom_input.lengths[LEGS] / LEG_NUMBERS;
    for (Index k = 0; k < driven_count(); k++) {
        const double *row = driven_row(k);
        state.path_count += row[1] > 0.0;
        state.has_driven_discs |= row[0] >= 0.0;
        state.has_wall_motions |= row[0] < 0.0;
    }
}

static Leg leg_from(const double *row) {
    return (Leg){row[0], row[1], row[2], row[3], row[4], row[5]};
}

static void write_paths(void) {
    const double *row = carom_input.arrays[LEGS];
    Leg *leg = state.legs;
    int number = 0;
    for (Index i = 0; i < state.disc_count && state.has_driven_discs; i++)
        state.disc_paths[i] = NO_PATH;
    for (Index k = 0; k < state.wall_count && state.has_wall_motions; k++)
        state.wall_motions[k] = (WallMotion){.path = NO_PATH};
    for (Index k = 0; k < driven_count(); k++) {
        Index body = (Index)driven_row(k)[0];
        Index count = (Index)driven_row(k)[1];
        if (body < 0)
            state.wall_motions[-1 - body].surface.belt = driven_row(k)[2];
        if (count == 0)
            continue;
        Path *path = &state.paths[number];
        *path = (Path){.body = body, .legs = leg, .leg_count = count};
        for (Index n = 0; n < count; n++, row += LEG_NUMBERS) {
            *leg = leg_from(row);
            path->fastest = greater(path->fastest, fabs(leg->vx) + fabs(leg->vy));
            leg++;
        }
        if (body >= 0) {
            path->x = state.discs[body].x;
            path->y = state.discs[body].y;
            state.disc_paths[body] = number;
        } else {
            WallMotion *motion = &state.wall_motions[-1 - body];
            motion->path = number;
            motion->surface.vx = path->legs[0].vx;
            motion->surface.vy = path->legs[0].vy;
        }
        number += 1;
    }
}

/* Begin a run of the input; return whether there was memory. */
CAROM_EXPORT("begin_pit") bool begin_pit(void) {
    const double *n = carom_input.numbers;
    memset(&state, 0, sizeof state);
    state.disc_count = carom_input.lengths[RADII];
    state.wall_count = carom_input.lengths[CHAIN_ROWS] / CHAIN_NUMBERS;
    state.edge_count = carom_input.lengths[EDGE_ROWS] / EDGE_NUMBERS;
    state.clock.step = 1.0;
    state.clock.rate = n[FRAME_RATE];
    state.law = input_law();
    state.gx = n[GRAVITY_X];
    state.gy = n[GRAVITY_Y];
    state.deceleration = n[TABLE_DECELERATION];
    state.rolling_resistance = n[ROLLING_RESISTANCE];
    state.damping.rate = n[DAMPING];
    state.motion = state.deceleration > 0.0 ? SLOWING : state.gx != 0.0 || state.gy != 0.0 ? FALLING : STRAIGHT;
    state.has_touched = state.law.restitution == 0.0;
    for (Index k = 0; k < state.wall_count; k++)
        state.has_touched |= carom_input.arrays[MATERIALS][2 * k] == 0.0;
    count_paths();
    state.has_chains = state.edge_count > 0;
    state.record.has_spins = n[HAS_SPINS] != 0.0;
    state.record.has_contacts = true;
    state.record.resize = carom_resize;
    char *memory = carom_resize(NULL, 0, carom_pit_lay_out(&state, NULL));
    if (memory == NULL)
        return false;
    carom_pit_lay_out(&state, memory);
    write_discs();
    write_walls();
    write_paths();
    carom_pit_begin(&state);
    return true;
}

/* Pass the frames before number `until`, and write `carom_results`; return whether there was memory. */
CAROM_EXPORT("advance_pit") bool advance_pit(Index until) {
    while (state.counts.frames < until && !state.is_out_of_memory && !state.is_too_far) {
        state.work = 0x1p30;
        carom_pit_run(&state, until, INT32_MAX);
    }
    write_record(&state.record);
    carom_results[IS_TOO_FAR] = state.is_too_far;
    return !state.is_out_of_memory;
}

/* Return x, y, vx and vy of each disc at a time not before the last frame; after them the spins, if a disc spins. */
CAROM_EXPORT("states_pit") double *states_pit(double time) {
    double *states = carom_resize(NULL, 0, (size_t)state.disc_count * 5 * sizeof(double));
    if (states != NULL) {
        carom_pit_write_states(&state, time, states);
        for (Index i = 0; i < state.disc_count && state.record.has_spins; i++)
            states[4 * state.disc_count + i] = state.turning[i].spin;
    }
    return states;
}
