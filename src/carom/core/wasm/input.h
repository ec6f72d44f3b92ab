/* Input and output of a run in WebAssembly: arrays of floats by kind, and single numbers by name.

   JavaScript lists the same names in the same order (`carom/live/core.js`). One run exists at a time: `begin_input`
   releases the memory of the run before. */

#ifndef CAROM_WASM_INPUT_H
#define CAROM_WASM_INPUT_H

#include "carom/core/carom_core.h"

/* Functions that JavaScript calls, by name. */
#define CAROM_EXPORT(name) __attribute__((export_name(name)))

typedef enum Array { /* those of `RunInput` in state.h, all as floats */
    POSITIONS,
    VELOCITIES,
    RADII,
    MASSES,
    SPINS,
    INERTIAS,
    WALLS,     /* if they are the obstacles */
    FEATURES,  /* else */
    MATERIALS, /* with features */
    DRIVEN,
    LEGS,
    GROUNDS,
    NEVER_LISTS,
    CHAIN_ROWS, /* of each wall: its number of edges (0 for a half-plane), half width and size, and if it is a
                   half-plane x, y, nx, ny */
    EDGE_ROWS,  /* of the chains in turn: rows of `ChainEdge` in chain_distance.h */
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
    HAS_SPINS, /* whether a disc spins or can come to spin */
    STANDSTILL_IMPACTS,
    FRAME_RATE,
    DURATION,
    NUMBERS,
} Number;

typedef enum Result { /* addresses and counts of rows, and the end of a run */
    IMPACTS, /* address of the rows `Impact` */
    IMPACT_COUNT,
    SPIN_ROWS, /* address; 0 if no disc spins */
    CONTACTS,
    MODES,
    MODE_COUNT,
    AMBIGUOUS,
    AMBIGUOUS_COUNT,
    ENDING, /* of PIC: `Ending` in state.h */
    REPORTED,
    NOW,
    NOW_LOW,
    EPOCH,
    EPOCH_REST,
    IS_TOO_FAR, /* whether discs met so far out that floats do not resolve the distance of their centres */
    RESULTS,
} Result;

typedef struct Input {
    double *arrays[ARRAYS]; /* NULL for one that was not given */
    Index lengths[ARRAYS];
    double numbers[NUMBERS];
} Input;

extern Input carom_input;
extern double carom_results[RESULTS];

/* The `Resize` of runs; memory is released all at once by `begin_input`. */
void *carom_resize(void *memory, size_t used, size_t size);

static inline Law input_law(void) {
    const double *n = carom_input.numbers;
    return (Law){
        n[RESTITUTION],
        n[WALL_RESTITUTION],
        0.0,
        {n[FRICTION], n[TANGENTIAL_RESTITUTION]},
        {n[WALL_FRICTION], n[WALL_TANGENTIAL_RESTITUTION]},
    };
}

/* Write where the recorded rows are. */
static inline void write_record(const Record *r) {
    carom_results[IMPACTS] = (double)(uintptr_t)r->rows;
    carom_results[IMPACT_COUNT] = (double)r->count;
    carom_results[SPIN_ROWS] = r->has_spins ? (double)(uintptr_t)r->spins : 0.0;
    carom_results[CONTACTS] = (double)(uintptr_t)r->contacts;
    carom_results[AMBIGUOUS] = (double)(uintptr_t)r->ambiguous;
    carom_results[AMBIGUOUS_COUNT] = (double)r->ambiguous_count;
}

#endif
