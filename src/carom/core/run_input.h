/* What a run of either loop is set up from: discs, walls and laws as arrays of numbers.

   A binding sets the pointers; the functions of the set-up read the arrays, and keep none of them. */

#pragma once

#include "carom/core/carom_core.h"
#include "carom/core/quartic_forms.h"

enum { /* numbers of a row */
    WALL_NUMBERS = 4,
    MATERIAL_NUMBERS = 2,
    DRIVEN_NUMBERS = 3,
    LEG_NUMBERS = 6,
    GROUND_NUMBERS = 4,
    CHAIN_NUMBERS = 7,
    EDGE_NUMBERS = 10,
};

typedef struct RunInput {
    const double *position; /* x and y of each disc */
    const double *velocity;
    const double *radius;
    const double *mass;    /* INF: no impact moves the disc */
    const double *spin;    /* NULL, like `inertia`, if no disc spins and none accelerates */
    const double *inertia; /* moment of inertia over mass times radius squared; INF: it never turns */
    Index disc_count;
    Index wall_count;
    const double *materials; /* restitution and friction of each wall; NULL if PIC has `walls`, which have those of the law */
    const double *driven;    /* rows of three: body, number of legs, belt speed. Walls, then discs, each ascending */
    const double *legs;      /* rows of six, of each driven body in turn: begins, ends, moved_x, moved_y, vx, vy */
    Index driven_count;
    Index leg_count;
    bool has_spins;
    bool has_finite_walls;
    bool has_acceleration; /* gravity, or a table that decelerates */
    double gravity[2];
    double deceleration;       /* of a table */
    double rolling_resistance; /* of discs on walls */
    Law law;
    Resize resize;

    /* ---- of PIC ---- */
    const double *walls;    /* x, y, nx and ny of each, if the walls are the obstacles, else NULL */
    const double *features; /* rows of FEATURE_NUMBERS; read if the features are the obstacles: always with acceleration */
    Index feature_count;
    const double *grounds;  /* with acceleration: of each feature is_ground, the vertex over each end, and how many
                               features a disc on it never meets; rows of four */
    const double *never_lists; /* these features, of each ground in turn */
    Index never_length;
    double cell_factor; /* on the width of a cell; INF for a single cell. It changes no result */
    Index standstill;
    bool solves_all_pairs; /* for comparison: without cells, queue and stored predictions. It changes no result */
    ExactQuartic exact;
    Corners corners;
    double until; /* end of the run, since the start, unless `carom_advance` is given a later one: see `State.until` */

    /* ---- of PIT ---- */
    const double *chains; /* of each wall: number of edges, half width and size; x, y, nx and ny if it has no edges */
    const double *edges;  /* of each chain in turn: rows of the first ten numbers of `ChainEdge` in chain_distance.h */
    Index edge_count;
    double step; /* frame k is at k * step / rate */
    double rate;
    double damping;  /* rate at which the discs are damped, a second; 0 for none */
    bool skips;      /* whether tests that can find nothing are skipped. It changes no result */
    double max_waste; /* how much work of skipping may be wasted: see `State.max_waste` in pit_state.h */
} RunInput;

/* Return whether some impact has restitution 0. */
static inline bool can_stop(const RunInput *input) {
    bool found = input->law.restitution == 0.0 || (input->wall_count > 0 && input->law.wall_restitution == 0.0);
    for (Index k = 0; k < input->wall_count && input->materials != NULL; k++)
        found = found || input->materials[MATERIAL_NUMBERS * k] == 0.0;
    return found;
}

/* Write the law of each wall, whose material is its own. */
static inline void write_wall_laws(Law *laws, const RunInput *input) {
    for (Index k = 0; k < input->wall_count; k++) {
        laws[k] = input->law;
        laws[k].wall_restitution = input->materials[MATERIAL_NUMBERS * k];
        laws[k].wall_contact.friction = input->materials[MATERIAL_NUMBERS * k + 1];
    }
}
