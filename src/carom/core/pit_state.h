/* State of the frame-sampled loop (PIT): to be read before its other headers.

   Units are metres, metres a second and kilograms; times are seconds since the start. Walls, spins, the impact law and
   recorded impacts are those of carom_core.h. */

#pragma once

#include "carom/core/arena.h"
#include "carom/core/carom_core.h"
#include "carom/core/chain_distance.h"
#include "carom/core/instant.h"
#include "carom/core/run_input.h"
#include "carom/core/touched.h"

enum {
    NO_CELL = -1,
    NO_PATH = -1,
    ON_WALL = -2,    /* less the number of a wall: the one that a disc met last */
    MAX_LEVELS = 16, /* of cells: the smallest discs on the last one are 2^-16 of the largest, and smaller */
    MAX_STEPS = 512, /* that the discs are advanced in one pass: 4 KiB of lengths */
};

/* ---- discs ---- */

typedef struct Disc { /* 64 bytes, one cache line: all that the tests of other discs read */
    double x;         /* centre at `State.now` */
    double y;
    double vx; /* velocity */
    double vy;
    double radius;
    double inverse_mass; /* 0: it never moves */
    int next;            /* the disc that follows in its cell's list, or NOBODY */
    int cell;            /* number of the list that it is in, or NO_CELL */
    int level;           /* of cells that it is kept on: the larger a disc, the lower */
    int last;            /* the body that it met last: a disc, `ON_WALL - k` for wall k, or NOBODY */
} Disc;

typedef struct ChainHit { /* what of a chain a disc met last */
    double nx;            /* unit vector from the chain to the disc */
    double ny;
    Index feature; /* the edge's number in `State.edges` and its part: see pit_separation.h */
} ChainHit;

typedef enum MotionKind { /* of all discs that impacts move */
    STRAIGHT = 0,
    FALLING = 1, /* under gravity, along parabolas */
    SLOWING = 2, /* on a table that slows each down against its motion, until it stops */
} MotionKind;

typedef struct Slowing { /* of a disc on a table */
    double ax;           /* acceleration */
    double ay;
    Instant stops; /* NEVER if it does not move */
} Slowing;

/* ---- driven bodies ---- */

typedef struct Leg { /* of a driven body's path */
    double begin;
    double end; /* INF for the last */
    double moved_x; /* how far the body has moved when it begins, metres */
    double moved_y;
    double vx;
    double vy;
} Leg;

typedef struct Path { /* of a driven body */
    Index body;       /* disc, or -1 - that wall */
    const Leg *legs;
    Index leg_count;
    Index leg; /* the one of the present frame */
    double x;  /* of a disc, where it was at the start */
    double y;
    double fastest; /* greatest speed on any leg */
} Path;

typedef struct WallMotion { /* of a wall at the present frame */
    int path;               /* NO_PATH if it does not move */
    double moved_x;         /* from its place at the start */
    double moved_y;
    Surface surface;
} WallMotion;

/* ---- cells ---- */

typedef struct Level { /* square cells for discs of about one size */
    double width;      /* of a cell */
    double leeway;     /* how far a disc may be from where it was when it was put into its cell */
    double reach;      /* the largest radius on this level, and the leeway */
    double radius;     /* the largest on this level */
    double density;    /* cells a metre in a sweep, of discs that have not moved: pit_sweep.h */
} Level;

typedef struct Grid {
    int *first;       /* of each list: a disc, or NOBODY. The cells of an unbounded plane share these lists. */
    Index list_count; /* a power of 2; 0 for so few discs that all count as near each other */
    Index level_count;
    Level levels[MAX_LEVELS];
    int *swept;      /* of each list in a sweep: a disc, or NOBODY */
    int *swept_next; /* the disc that follows a disc in its list in a sweep, or NOBODY */
} Grid;

/* ---- the tests of one frame ---- */

typedef uint64_t Test; /* a pair's or a wall's place in the order of Algorithm 1: pit_pending.h */

typedef struct Pending { /* tests still to be made at this frame: a binary heap, the next one on top */
    Test *heap;
    Index count;
    Index capacity;
    Test last; /* the last one made at this frame, or NO_TEST */
} Pending;

/* ---- searches ---- */

typedef struct Search { /* the last one around a disc */
    Index frame;        /* one more than the frame's number; 0 for none */
    Index first;        /* place in `Touching` of the bodies that it may touch at that frame */
    Index count;        /* of these */
    bool is_stale;      /* whether an impact has changed its path since */
} Search;

typedef struct Touching { /* bodies, a wall k as -1 - k */
    int *bodies;
    Index count;
    Index capacity;
} Touching;

typedef struct Clearance { /* of a disc's centre at a place */
    double x;
    double y;
    double gap; /* lower bound of its distance from all walls that never move, metres */
    Index edge; /* of all edges, one that may be near */
} Clearance;

/* ---- the run ---- */

typedef struct Clock { /* frame k is at k * step / rate, and one of the two is 1: neither form adds a rounding */
    double step;       /* seconds */
    double rate;       /* frames a second */
} Clock;

typedef struct Damping { /* damped discs move straight in undamped time: damping.h */
    double rate;         /* a second; 0 for none */
    Index frame;         /* whose undamped time was computed last */
    double time;         /* of that frame */
} Damping;

typedef struct Counts {
    Index frames; /* passed: those before this number */
    Index tested; /* frames at which anything was tested */
    Index pair_tests;
} Counts;

typedef struct State {
    Disc *discs;
    Wall *walls;              /* half-planes */
    Law *wall_laws;           /* the law of each wall */
    Chain *chains;            /* one a wall; NULL if all walls are half-planes */
    ChainEdge *edges;         /* of all chains */
    ChainHit *hits;           /* one a disc, with chains */
    TouchedBodies *touched;   /* one a disc; NULL if each impact leaves a speed along its normal */
    Turning *turning;         /* one a disc, with spin */
    Slowing *slowing;         /* one a disc, on a table */
    Path *paths;              /* of driven bodies */
    Leg *legs;                /* of all paths */
    int *disc_paths;          /* one a disc, NO_PATH if it is not driven; NULL if no disc is */
    WallMotion *wall_motions; /* one a wall; NULL if no wall moves and no surface does */
    Search *searches;         /* one a disc */
    Clearance *clearances;    /* one a disc */
    double *due;              /* before this time no impact of a disc can be due; INF for one that never moves */
    int *due_discs;           /* discs that are due at this frame */
    int *stale_discs;         /* whose searches are stale at this frame */
    Index disc_count;
    Index wall_count;
    Index path_count;
    Index stale_count;
    MotionKind motion;
    double gx; /* gravity */
    double gy;
    double rolling_resistance; /* of discs on walls, under gravity */
    double deceleration;       /* of a table */
    Damping damping;
    Clock clock;
    double now;          /* time of the frame that was passed last; with damping the undamped time */
    double reported;     /* the same by the clock */
    double next_due;     /* no disc is due before */
    bool is_settled;     /* whether no impact was found at the last frame that was tested */
    double frame_span;   /* length of as many frames as a bound holds for at most, seconds */
    double horizon;      /* how long a bound holds at most from now on, seconds */
    double pull;         /* magnitude of gravity, rounded up */
    double wall_size;    /* more than any coordinate and radius of a wall */
    double extra_extent; /* what `extent_of` adds for gravity and for the paths of driven bodies */
    bool skips;          /* whether tests that can find nothing are skipped */
    Index row;           /* plain looping: the disc whose tests come next at this frame; 0 between frames */
    double excess;       /* work of skipping beyond that of testing all at each frame */
    double first_search; /* work of scheduling all discs once */
    double max_waste;    /* how many times that much may be in excess */
    bool pays_back;      /* whether all is tested at each frame, since there was more */
    double work;         /* left until a pause; all work is counted in tests of two discs by plain looping */
    bool is_out_of_memory;
    bool is_too_far; /* whether discs met so far out that floats do not resolve the distance of their centres */
    Law law;
    Counts counts;
    Grid grid;
    Pending pending;
    Touching touching;
    Record record;
    double steps[MAX_STEPS]; /* lengths of the steps to the next frames */
    double times[MAX_STEPS]; /* of these frames */
} State;

/* ---- what bindings call, in this order ---- */

/* Set the sizes of a run; return how many bytes of memory it needs, 0 if there are too many discs and walls. */
size_t carom_pit_set_up(State *s, const RunInput *input);

/* Fill the memory of a run, which begins at a cache line. */
void carom_pit_begin(State *s, const RunInput *input, void *memory);

/* Pass the frames before number `until`, until work or memory is used up, or until there have been `most` impacts. */
void carom_pit_run(State *s, Index until, Index most);

/* Write x, y, vx, vy of each disc at a time not before the last frame; with damping an undamped time, and undamped
   velocities. */
void carom_pit_write_states(const State *s, double time, double *states);
