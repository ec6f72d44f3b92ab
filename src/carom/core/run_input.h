/* Input of a run of either solver: discs, walls and laws as arrays of numbers.

   A binding (the code between the core and another language) sets the pointers. The set-up functions read the arrays
   and keep no pointers to them. */

#pragma once

#include "carom/core/carom_core.h"
#include "carom/core/quartic/polynomial.h"

enum { /* numbers in each row of the arrays of a `RunInput` */
    WALL_NUMBERS = 4,
    MATERIAL_NUMBERS = 2,
    DRIVEN_NUMBERS = 3,
    LEG_NUMBERS = 6,
    GROUND_NUMBERS = 4,
    CHAIN_NUMBERS = 7,
    EDGE_NUMBERS = 10,
};

typedef struct RunInput {
    const double *position; /* x and y of each disc's centre, in metres */
    const double *velocity;
    const double *radius;
    const double *mass;    /* mass of each disc, in kilograms; INF for a disc that no impact moves */
    /* spin of each disc, in rad/s. `spin` and `inertia` are NULL if no disc spins and no disc accelerates */
    const double *spin;
    /* moment of inertia of each disc, divided by mass times radius squared; INF if the disc never turns */
    const double *inertia;
    Index disc_count;
    Index wall_count;
    /* restitution and friction of each wall; NULL if PIC uses `walls`, which all have the coefficients of `law` */
    const double *materials;
    /* a row of three numbers for each driven body: its number, the number of its legs, and the speed of its conveyor
       surface. Walls come first, then discs, both in ascending order */
    const double *driven;
    /* a row of six numbers for each leg, body by body: begin, end, moved_x, moved_y, vx, vy, as in `Leg` */
    const double *legs;
    Index driven_count;
    Index leg_count;
    bool has_spins;
    bool has_finite_walls;
    bool has_acceleration; /* whether there is gravity or a table that decelerates discs */
    double gravity[2];
    double deceleration;       /* deceleration of discs by the table, in m/s^2 */
    double rolling_resistance; /* coefficient of rolling resistance of discs on walls */
    Law law;
    Resize resize;

    /* ---- only for PIC ---- */
    const double *walls;    /* x, y, nx and ny of each wall, if obstacles are whole walls; else NULL */
    /* a row of FEATURE_NUMBERS floats for each feature, if obstacles are features. In runs with acceleration, obstacles
       are always features */
    const double *features;
    Index feature_count;
    /* a row of four numbers for each feature, used if discs accelerate. The numbers are: whether a disc can slide, roll
       or rest on the feature; the vertices at its two ends; how many features a disc on this feature never hits */
    const double *grounds;
    /* for each row of `grounds`, the numbers of the features that a disc on this feature never hits */
    const double *never_lists;
    Index never_length;
    /* factor that multiplies the width of a cell; INF makes a single cell. With the factor 1, a run with few bodies
       uses no cells (few_bodies.h). The factor does not change results */
    double cell_factor;
    Index standstill;
    /* whether the run uses the all-pairs loop (all_pairs.h), which is slower and has the same results */
    bool solves_all_pairs;
    ExactQuartic exact;
    Corners corners;
    /* end of the run, in seconds since its start. If a later end is passed to `carom_advance`, it replaces this end.
       See `State.until` */
    double until;

    /* ---- only for PIT ---- */
    /* a row of CHAIN_NUMBERS for each wall: number of edges, half width, size, x, y, nx and ny. Only a half-plane has
       x, y, nx and ny, and a half-plane has no edges */
    const double *chains;
    /* a row for each edge, chain by chain: the first ten fields of `ChainEdge` in chain_distance.h */
    const double *edges;
    Index edge_count;
    double step; /* frame k is at the time k * step / rate, in seconds since the start */
    double rate;
    double damping;  /* rate at which discs are damped, in 1/s; 0 for none */
    bool skips;      /* whether the run skips tests that cannot find an impact. Skipping changes no result */
    double max_waste; /* limit of the work that skipping may waste: see `State.max_waste` in pit/state.h */
} RunInput;

/* Return leg number `n` of the input. Legs are counted over the paths of all driven bodies. */
static inline Leg leg_of(const RunInput *input, Index n) {
    const double *leg = input->legs + LEG_NUMBERS * n;
    return (Leg){leg[0], leg[1], leg[0], leg[1], leg[2], leg[3], leg[4], leg[5]};
}

/* Return whether any impact has restitution 0. */
static inline bool has_inelastic_body(const RunInput *input) {
    bool found = input->law.restitution == 0.0 || (input->wall_count > 0 && input->law.wall_restitution == 0.0);
    for (Index k = 0; k < input->wall_count && input->materials != NULL; k++)
        found = found || input->materials[MATERIAL_NUMBERS * k] == 0.0;
    return found;
}

/* Write the law of each wall: the run's law with the material of this wall. */
static inline void write_wall_laws(Law *laws, const RunInput *input) {
    for (Index k = 0; k < input->wall_count; k++) {
        laws[k] = input->law;
        laws[k].wall_restitution = input->materials[MATERIAL_NUMBERS * k];
        laws[k].wall_contact.friction = input->materials[MATERIAL_NUMBERS * k + 1];
    }
}
