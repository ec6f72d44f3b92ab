/* State of the frame-sampled loop (PIT). Read this file before the other headers of PIT.

   Units are metres, metres per second and kilograms; times are seconds since the start. Walls, spins, the impact law
   and recorded impacts are in carom_core.h. */

#pragma once

#include "carom/core/damping.h"
#include "carom/core/pit/chain_distance.h"
#include "carom/core/run_input.h"
#include "carom/core/touched_bodies.h"

enum {
    NO_CELL = -1,
    NO_PATH = -1,
    ON_WALL = -2,    /* `Disc.last` is ON_WALL - k if the disc hit wall k last */
    MAX_LEVELS = 16, /* of cells. The radius of a disc on the last level is at most 2^-15 of the largest */
    /* largest number of steps over which discs are advanced in one pass; the steps' lengths take 4 KiB */
    MAX_STEPS = 512,
};

/* ---- discs ---- */

typedef struct Disc { /* 64 bytes, one cache line, with all data that tests of other discs read */
    double x;         /* centre at `State.now` */
    double y;
    double vx; /* velocity */
    double vy;
    double radius;
    double inverse_mass; /* 0 for a disc that never moves */
    int next;            /* the next disc in its cell's list, or NOBODY */
    int cell;            /* number of the list that contains it, or NO_CELL */
    int level;           /* level of cells on which it is kept; larger discs are on lower levels */
    int last;            /* the body that it hit last: a disc, `ON_WALL - k` for wall k, or NOBODY */
} Disc;

typedef struct ChainHit { /* the part of a chain that a disc hit last */
    double nx;            /* unit vector from the chain to the disc */
    double ny;
    Index feature; /* number of a part of an edge in `State.edges`: see `feature_at` in pit/separation.h */
} ChainHit;

typedef enum MotionKind { /* motion of all movable discs between impacts */
    STRAIGHT = 0,
    FALLING = 1, /* under gravity, along parabolas */
    SLOWING = 2, /* on a table that slows each disc down until it stops */
} MotionKind;

/* ---- driven bodies ---- */

typedef struct Path { /* path of a driven body */
    Index body;       /* disc i as i, wall k as -1 - k */
    const Leg *legs;
    Index leg_count;
    Index leg; /* the leg at the present frame */
    double x;  /* start position of a disc */
    double y;
    double fastest; /* greatest speed on any leg */
} Path;

typedef struct WallMotion { /* motion of a wall at the present frame */
    int path;               /* NO_PATH if it does not move */
    double moved_x;         /* displacement from its start position */
    double moved_y;
    Surface surface;
} WallMotion;

/* ---- cells ---- */

typedef struct Level { /* square cells for discs of about the same size */
    double width;      /* of a cell */
    double leeway;     /* how far a disc may move from where it was put into its cell */
    double reach;      /* the largest radius on this level plus the leeway */
    double radius;     /* the largest on this level */
    double density;    /* cells per metre in a sweep, which needs no leeway: see sweep.h */
} Level;

typedef struct Grid {
    int *first;       /* first disc of each list, or NOBODY. The cells of the whole plane share these lists */
    Index list_count; /* a power of 2; 0 for so few discs that all are treated as near each other */
    Index level_count;
    Level levels[MAX_LEVELS];
    int *swept;      /* first disc of each list in a sweep, or NOBODY */
    int *swept_next; /* for each disc the next disc of its list in a sweep, or NOBODY */
} Grid;

/* ---- the tests of one frame ---- */

typedef uint64_t Test; /* number of a test: its place in the order of Algorithm 1, see pending_tests.h */

typedef struct Pending { /* tests still to be made at this frame: a binary heap with the next test on top */
    Test *heap;
    Index count;
    Index capacity;
    Test last; /* the last test made at this frame, or NO_TEST */
} Pending;

/* ---- searches ---- */

typedef struct Search { /* the last search around a disc */
    Index frame;        /* number of the frame plus 1; 0 for none */
    Index first;        /* index in `Touching.bodies` of the first body that the disc may touch at that frame */
    Index count;        /* number of bodies that it may touch */
    bool is_stale;      /* whether an impact has changed the disc's path since the search */
} Search;

typedef struct Touching { /* bodies that discs may touch; wall k is -1 - k */
    int *bodies;
    Index count;
    Index capacity;
} Touching;

typedef struct Clearance { /* clearance of a disc from walls, at a position of its centre */
    double x;
    double y;
    double gap; /* lower bound of its distance from all walls that never move, in metres */
    Index edge; /* an edge, in any chain, that is probably near the disc */
} Clearance;

/* ---- the run ---- */

typedef struct Clock { /* frame k is at k * step / rate. One of the two is 1, so they add no rounding error */
    double step;       /* seconds */
    double rate;       /* frames per second */
} Clock;

typedef struct Damping { /* damping.h: damped discs move straight in undamped time */
    double rate;         /* per second; 0 for none */
    Index frame;         /* the last frame whose undamped time was computed */
    double time;         /* undamped time of that frame */
} Damping;

typedef struct Counts {
    Index frames; /* number of frames passed */
    Index tested; /* number of frames at which anything was tested */
    Index pair_tests;
} Counts;

typedef struct State {
    Disc *discs;
    Wall *walls;              /* half-planes */
    Law *wall_laws;           /* the law of each wall */
    Chain *chains;            /* one per wall; NULL if all walls are half-planes */
    ChainEdge *edges;         /* of all chains */
    ChainHit *hits;           /* one per disc, if there are chains */
    TouchedBodies *touched;   /* one per disc; NULL if no impact has restitution 0 */
    Turning *turning;         /* one per disc, if discs spin */
    Slowing *slowing;         /* one per disc, on a table */
    Path *paths;              /* of driven bodies */
    Leg *legs;                /* of all paths */
    int *disc_paths;          /* path of each disc, NO_PATH if it is not driven; NULL if no disc is driven */
    WallMotion *wall_motions; /* one per wall; NULL if no wall and no surface moves */
    Search *searches;         /* one per disc */
    Clearance *clearances;    /* one per disc */
    double *due;              /* time before which no impact of a disc is possible; INF for a disc that never moves */
    int *due_discs;           /* discs that are due at this frame */
    int *stale_discs;         /* discs whose searches are stale at this frame */
    Index disc_count;
    Index wall_count;
    Index path_count;
    Index stale_count;
    MotionKind motion;
    double gx; /* gravity */
    double gy;
    double rolling_resistance; /* of discs on walls, under gravity */
    double deceleration;       /* of the table */
    Damping damping;
    Clock clock;
    double now;          /* time of the last passed frame; with damping the undamped time */
    double reported;     /* the same time by the clock, not undamped */
    double next_due;     /* before this time no disc is due */
    bool is_settled;     /* whether no impact was found at the last tested frame */
    double frame_span;   /* length of the largest number of frames for which a bound is used, in seconds */
    double horizon;      /* longest time for which a bound is used from now on, in seconds */
    double pull;         /* magnitude of gravity, rounded up */
    double wall_size;    /* an upper bound of all coordinates and radii of walls */
    double extra_extent; /* length that `extent_of` adds for gravity and for the paths of driven bodies */
    bool skips;          /* whether tests that can find nothing are skipped */
    Index row;           /* plain looping: the disc whose tests are next at this frame; 0 between frames */
    double excess;       /* by how much the work of skipping exceeds that of testing all pairs at each frame */
    double first_search; /* work of scheduling all discs once */
    double max_waste;    /* largest allowed excess, as a multiple of `first_search` */
    bool pays_back;      /* whether all tests are made at each frame because the excess was too large */
    double work;         /* work left before a pause, in tests of two discs by plain looping */
    bool is_out_of_memory;
    /* whether floats do not resolve the distance between the centres of two discs that met far from the origin */
    bool is_too_far;
    Law law;
    Counts counts;
    Grid grid;
    Pending pending;
    Touching touching;
    Record record;
    double steps[MAX_STEPS]; /* lengths of the steps to the next frames */
    double times[MAX_STEPS]; /* times of these frames */
} State;

/* ---- functions for bindings, in the order of calls ---- */

/* Set the sizes of a run. Return the number of bytes that it needs, or 0 if there are too many discs and walls. */
size_t carom_pit_set_up(State *s, const RunInput *input);

/* Fill the memory of a run, which must begin at a cache line. */
void carom_pit_begin(State *s, const RunInput *input, void *memory);

/* Compute all frames with numbers below `until`. Stop earlier if `State.work` or memory is used up, or after `most`
   impacts. */
void carom_pit_run(State *s, Index until, Index most);

/* Write x, y, vx, vy of each disc at a time that is not before the last frame. With damping, time and velocities are
   undamped. */
void carom_pit_write_states(const State *s, double time, double *states);
