/* Input of a run of either solver: discs, walls and laws as arrays of numbers.

   A binding sets the pointers. The set-up functions read the arrays and keep no pointers to them. */

#pragma once

#include "carom/core/carom_core.h"
#include "carom/core/quartic/polynomial.h"

enum { /* numbers per row */
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
    const double *mass;    /* INF for a disc that no impact moves */
    const double *spin;    /* NULL, like `inertia`, if no disc spins and no disc accelerates */
    const double *inertia; /* moment of inertia divided by mass times radius squared; INF if it never turns */
    Index disc_count;
    Index wall_count;
    /* restitution and friction of each wall; NULL if PIC uses `walls`, whose coefficients are those of `law` */
    const double *materials;
    const double *driven; /* rows of three: body, number of legs, belt speed. Walls first, then discs, each ascending */
    const double *legs;      /* rows of six, body by body: begin, end, moved_x, moved_y, vx, vy */
    Index driven_count;
    Index leg_count;
    bool has_spins;
    bool has_finite_walls;
    bool has_acceleration; /* gravity, or a table that decelerates */
    double gravity[2];
    double deceleration;       /* of the table */
    double rolling_resistance; /* of discs on walls */
    Law law;
    Resize resize;

    /* ---- only for PIC ---- */
    const double *walls;    /* x, y, nx and ny of each wall, if the walls are the obstacles; otherwise NULL */
    /* rows of FEATURE_NUMBERS floats; used if the features are the obstacles. With acceleration they always are */
    const double *features;
    Index feature_count;
    /* with acceleration, a row of four for each feature: is_ground, the vertex at each end, and the number of features
       that a disc on this feature never hits */
    const double *grounds;
    const double *never_lists; /* numbers of these features, ground by ground */
    Index never_length;
    double cell_factor; /* factor on the width of a cell; INF for a single cell. It changes no result */
    Index standstill;
    bool solves_all_pairs; /* whether to use the all-pairs loop, for comparison. It changes no result */
    ExactQuartic exact;
    Corners corners;
    /* end of the run, counted from its start, unless `carom_advance` is called with a later end: see `State.until` */
    double until;

    /* ---- only for PIT ---- */
    /* of each wall: number of edges, half width and size; or x, y, nx and ny if it has no edges */
    const double *chains;
    const double *edges;  /* chain by chain: rows of the first ten numbers of `ChainEdge` in chain_distance.h */
    Index edge_count;
    double step; /* frame k is at k * step / rate */
    double rate;
    double damping;  /* rate at which discs are damped, in 1/s; 0 for none */
    bool skips;      /* whether tests that can find nothing are skipped. It changes no result */
    double max_waste; /* largest allowed excess of the work of skipping: see `State.max_waste` in pit/state.h */
} RunInput;

/* Return leg `n`, counted over all paths. */
static inline Leg leg_of(const RunInput *input, Index n) {
    const double *leg = input->legs + LEG_NUMBERS * n;
    return (Leg){leg[0], leg[1], leg[0], leg[1], leg[2], leg[3], leg[4], leg[5]};
}

/* Return whether some impact has restitution 0. */
static inline bool can_stop(const RunInput *input) {
    bool found = input->law.restitution == 0.0 || (input->wall_count > 0 && input->law.wall_restitution == 0.0);
    for (Index k = 0; k < input->wall_count && input->materials != NULL; k++)
        found = found || input->materials[MATERIAL_NUMBERS * k] == 0.0;
    return found;
}

/* Write the law of each wall: the law of the run with the material of that wall. */
static inline void write_wall_laws(Law *laws, const RunInput *input) {
    for (Index k = 0; k < input->wall_count; k++) {
        laws[k] = input->law;
        laws[k].wall_restitution = input->materials[MATERIAL_NUMBERS * k];
        laws[k].wall_contact.friction = input->materials[MATERIAL_NUMBERS * k + 1];
    }
}
