/* Input and output of a run in WebAssembly: arrays of floats, identified by kind, and single numbers, identified by
   name.

   `carom/web/wasm_core.js` has the same names in the same order. Only one run exists at a time, because
   `begin_input` frees the memory of the previous run. */

#pragma once

#include "carom/core/feature.h"
#include "carom/core/run_input.h"

/* Mark a function that JavaScript calls by a name. */
#define CAROM_EXPORT(name) __attribute__((export_name(name)))

typedef enum Array { /* the arrays of `RunInput` */
    POSITIONS,
    VELOCITIES,
    RADII,
    MASSES,
    SPINS,
    INERTIAS,
    WALLS,     /* used if obstacles are whole walls */
    FEATURES,  /* used if obstacles are features */
    MATERIALS, /* used together with FEATURES */
    DRIVEN,
    LEGS,
    GROUNDS,
    NEVER_LISTS,
    CHAIN_ROWS,
    EDGE_ROWS,
    ARRAYS,
} Array;

typedef enum Number {
    RESTITUTION,
    WALL_RESTITUTION,
    FRICTION,
    WALL_FRICTION,
    TANGENTIAL_RESTITUTION,
    WALL_TANGENTIAL_RESTITUTION,
    GRAVITY_X,
    GRAVITY_Y,
    TABLE_DECELERATION,
    ROLLING_RESISTANCE,
    DAMPING,
    HAS_SPINS, /* whether a disc spins or can begin to spin */
    STANDSTILL_IMPACTS,
    FRAME_RATE,
    DURATION,
    NUMBERS,
} Number;

/* the numbers that a run returns: addresses and counts of rows, the run's ending, and times */
typedef enum Result {
    IMPACTS, /* address of rows of `Impact` */
    IMPACT_COUNT,
    SPIN_ROWS, /* address of rows of `Spins`; 0 if no disc spins */
    CONTACTS,
    MODES,
    MODE_COUNT,
    AMBIGUOUS,
    AMBIGUOUS_COUNT,
    ENDING, /* how a run of PIC has ended: `Ending` in pic/state.h */
    REPORTED,
    NOW,
    NOW_LOW,
    EPOCH,
    EPOCH_REST,
    IS_TOO_FAR, /* whether two discs have met too far from the origin to compute the normal of their impact */
    RESULTS,
} Result;

typedef struct Input {
    double *arrays[ARRAYS]; /* NULL for an array that is not given */
    Index lengths[ARRAYS];
    double numbers[NUMBERS];
} Input;

extern Input carom_input;
extern double carom_results[RESULTS];

/* The `Resize` function of all runs, which never frees memory. `begin_input` frees all memory at once. */
void *carom_resize(void *memory, size_t used, size_t size);

/* Return the input of a run of either solver. */
static inline RunInput run_input(void) {
    double *const *arrays = carom_input.arrays;
    const Index *lengths = carom_input.lengths;
    const double *n = carom_input.numbers;
    return (RunInput){
        .position = arrays[POSITIONS],
        .velocity = arrays[VELOCITIES],
        .radius = arrays[RADII],
        .mass = arrays[MASSES],
        .spin = arrays[SPINS],
        .inertia = arrays[INERTIAS],
        .disc_count = lengths[RADII],
        .wall_count = lengths[WALLS] / WALL_NUMBERS + lengths[MATERIALS] / MATERIAL_NUMBERS,
        .materials = arrays[MATERIALS],
        .driven = arrays[DRIVEN],
        .legs = arrays[LEGS],
        .driven_count = lengths[DRIVEN] / DRIVEN_NUMBERS,
        .leg_count = lengths[LEGS] / LEG_NUMBERS,
        .has_spins = n[HAS_SPINS] != 0.0,
        .has_finite_walls = true, /* so that the positions of all impacts are recorded: the page draws them */
        .has_acceleration = n[GRAVITY_X] != 0.0 || n[GRAVITY_Y] != 0.0 || n[TABLE_DECELERATION] != 0.0,
        .gravity = {n[GRAVITY_X], n[GRAVITY_Y]},
        .deceleration = n[TABLE_DECELERATION],
        .rolling_resistance = n[ROLLING_RESISTANCE],
        .law = {
            n[RESTITUTION],
            n[WALL_RESTITUTION],
            0.0,
            {n[FRICTION], n[TANGENTIAL_RESTITUTION]},
            {n[WALL_FRICTION], n[WALL_TANGENTIAL_RESTITUTION]},
        },
        .resize = carom_resize,
        .walls = arrays[WALLS],
        .features = arrays[FEATURES],
        .feature_count = lengths[FEATURES] / FEATURE_NUMBERS,
        .grounds = arrays[GROUNDS],
        .never_lists = arrays[NEVER_LISTS],
        .never_length = lengths[NEVER_LISTS],
        .cell_factor = 1.0,
        .standstill = (Index)n[STANDSTILL_IMPACTS],
        .until = n[DURATION],
        .chains = arrays[CHAIN_ROWS],
        .edges = arrays[EDGE_ROWS],
        .edge_count = lengths[EDGE_ROWS] / EDGE_NUMBERS,
        .step = 1.0,
        .rate = n[FRAME_RATE],
        .damping = n[DAMPING],
    };
}

/* Write the addresses and counts of the recorded rows. */
static inline void write_record(const Record *r) {
    carom_results[IMPACTS] = (double)(uintptr_t)r->rows;
    carom_results[IMPACT_COUNT] = (double)r->count;
    carom_results[SPIN_ROWS] = r->has_spins ? (double)(uintptr_t)r->spins : 0.0;
    carom_results[CONTACTS] = (double)(uintptr_t)r->contacts;
    carom_results[AMBIGUOUS] = (double)(uintptr_t)r->ambiguous;
    carom_results[AMBIGUOUS_COUNT] = (double)r->ambiguous_count;
}
