/* State of the frame-sampled loop (PIT). Read this file before the other headers of PIT.

   Units are metres, metres per second and kilograms. Times are in seconds since the start. Walls, spins, the impact law
   and recorded impacts are in carom_core.h. */

#pragma once

#include "carom/core/damping.h"
#include "carom/core/pit/chain_distance.h"
#include "carom/core/run_input.h"

enum {
    NO_CELL = -1,
    NO_PATH = -1,
    /* if a disc hit wall k last, its `Disc.last` is ON_WALL - k */
    ON_WALL = -2,
    /* largest number of levels of cells. The radius of each disc on the last level is at most 2^-15 of the largest
       radius */
    MAX_LEVELS = 16,
    /* largest number of frames over which discs are advanced in one pass. The array of step lengths takes 4 KiB */
    MAX_STEPS = 512,
    /* In the plane, the components along two normals that are not parallel determine a velocity. A third contact is
       needed if a wall is stored twice. */
    MOST_STORED = 3,
};

/* ---- discs ---- */

typedef struct Disc { /* 64 bytes, one cache line, with all data of a disc that tests with other discs read */
    double x;         /* centre at `State.now`, in metres */
    double y;
    double vx; /* velocity */
    double vy;
    double radius;
    /* 1 / mass; 0 for a disc that never moves */
    double inverse_mass;
    /* the next disc in its cell's list, or NOBODY */
    int next;
    /* number of the list of discs that contains the disc: its index in `Grid.first`, or NO_CELL */
    int cell;
    /* number of the disc's level of cells; levels with lower numbers are for larger discs */
    int level;
    /* the body that the disc hit last: the number of a disc, `ON_WALL - k` for wall k, or NOBODY */
    int last;
} Disc;

typedef struct ChainHit { /* the part of a chain that a disc hit last */
    double nx;            /* unit vector from the chain to the disc at the impact */
    double ny;
    Index feature; /* number of a side or an end of an edge: see `feature_at` in pit/separation.h */
} ChainHit;

/* the last impact of a disc with a body, stored if its restitution was 0: see pit/contact.h */
typedef struct StoredImpact {
    /* number of the body: j for disc j, -1 - k for half-plane k, -1 - wall_count - f for feature f of a chain */
    int body;
    double nx;   /* unit normal of the impact */
    double ny;
    /* distance of the two surfaces at the impact, in metres; negative if they overlapped */
    double gap;
    /* rounding error of the direction of the normal, in radians */
    double turn;
    /* |vx| + |vy| of the disc plus |vx| + |vy| of the body, just before the impact */
    double speeds;
    /* speed of approach just after the impact plus its rounding error, in metres per second */
    double left;
    /* rounding errors of the relative velocity along the normal and along the tangent, in metres per second */
    double normal_error;
    double tangent_error;
} StoredImpact;

typedef struct StoredImpacts { /* stored impacts of one disc, oldest first */
    int count;
    StoredImpact last[MOST_STORED];
} StoredImpacts;

typedef enum MotionKind { /* motion of all movable discs between impacts */
    STRAIGHT = 0,
    FALLING = 1, /* discs fall under gravity, along parabolas */
    SLOWING = 2, /* discs are on a table that slows each of them down until it stops */
} MotionKind;

/* ---- driven bodies ---- */

typedef struct Path { /* path of a driven body */
    Index body;       /* number of the body: i for disc i, -1 - k for wall k */
    const Leg *legs;
    Index leg_count;
    Index leg; /* number of the leg (straight part of the path) at the present frame */
    double x;  /* for a disc: centre at the start of the run, in metres */
    double y;
    double fastest; /* greatest speed on any part of the path */
} Path;

typedef struct WallMotion { /* motion of a wall at the present frame */
    int path;               /* NO_PATH if the wall does not move */
    double moved_x;         /* displacement of the wall from its start position, in metres */
    double moved_y;
    Surface surface;
} WallMotion;

/* ---- cells ---- */

/* square cells for discs of about the same size */
typedef struct Level {
    /* width of a cell, in metres */
    double width;
    /* leeway: distance that a disc may move after it was put into its cell, in metres */
    double leeway;
    /* sum of the largest radius on this level and the leeway */
    double reach;
    /* largest radius of a disc on this level */
    double radius;
    /* number of cells per metre in a sweep (sweep.h). The cells of a sweep are smaller, because they include no
       leeway */
    double density;
} Level;

typedef struct Grid {
    /* first disc of each list of discs, or NOBODY. Each list contains the discs of several cells */
    int *first;
    /* number of lists, a power of 2; 0 if there are so few discs that no cells are used */
    Index list_count;
    Index level_count;
    Level levels[MAX_LEVELS];
    int *swept;      /* in a sweep: first disc of each list of discs, or NOBODY */
    int *swept_next; /* in a sweep: for each disc, the next disc of its list, or NOBODY */
} Grid;

/* ---- the tests of one frame ---- */

/* number of a test; later tests in Algorithm 1 of the source paper have higher numbers: see pending_tests.h */
typedef uint64_t Test;

typedef struct Pending { /* tests still to be made at this frame: a binary heap whose top is the next test */
    Test *heap;
    Index count;
    Index capacity;
    Test last; /* the latest test made at this frame, or NO_TEST */
} Pending;

/* ---- searches ---- */

typedef struct Search { /* result of the last search for the bodies near a disc */
    Index frame;        /* number of the frame of the search, plus 1; 0 if there was no search */
    Index first; /* index in `Touching.bodies` of the first body that the disc may touch at the frame of the search */
    Index count;        /* number of bodies that the disc may touch */
    bool is_stale;      /* whether an impact has changed the disc's path since the search */
} Search;

/* bodies that discs with possible impacts may touch, disc after disc; wall k has the number -1 - k */
typedef struct Touching {
    int *bodies;
    Index count;
    Index capacity;
} Touching;

/* clearance (lower bound of the distance from walls) of a disc, computed when its centre was at (x, y) */
typedef struct Clearance {
    double x;
    double y;
    double gap; /* lower bound of the distance of (x, y) from all walls that never move, in metres */
    Index edge; /* an edge, in any chain, that is probably near the disc */
} Clearance;

/* ---- the run ---- */

/* frame k is at the time k * step / rate. Either `step` or `rate` is 1, so that only one operation rounds */
typedef struct Clock {
    double step;       /* seconds */
    double rate;       /* frames per second */
} Clock;

/* linear damping (damping.h): discs are advanced in a transformed time, the undamped time, in which they move without
   damping */
typedef struct Damping {
    double rate;         /* damping rate, per second; 0 for no damping */
    Index frame;         /* the last frame whose undamped time was computed */
    double time;         /* undamped time of the frame with the number `frame` */
} Damping;

typedef struct Counts {
    Index frames; /* number of frames computed or skipped so far */
    Index tested; /* number of frames so far at which a test was made */
    Index pair_tests;
} Counts;

typedef struct State {
    Disc *discs;
    Wall *walls;              /* half-planes */
    Law *wall_laws;           /* the law of each wall */
    Chain *chains;            /* one chain per wall; NULL if all walls are half-planes */
    ChainEdge *edges;         /* edges of all chains (finite walls), chain by chain */
    ChainHit *hits;           /* part of a chain that each disc hit last; used only if there are chains */
    StoredImpacts *stored; /* for each disc, its last impacts with restitution 0; NULL if no impact has restitution 0 */
    Turning *turning;         /* rotation of each disc; used only if discs spin */
    Slowing *slowing;         /* deceleration of each disc; used only on a table that slows discs down */
    Path *paths;
    /* legs (straight parts) of all paths, path by path */
    Leg *legs;
    /* number of each disc's path in `paths`; NO_PATH for a disc that is not driven. NULL if no disc is driven */
    int *disc_paths;
    WallMotion *wall_motions; /* motion of each wall; NULL if no wall and no surface moves */
    Search *searches;
    /* clearance of each disc: a lower bound of its distance from walls */
    Clearance *clearances;
    /* due time of each disc: no impact of the disc is possible before this time; INF for a disc that never moves */
    double *due;
    int *due_discs;           /* discs whose due times have come, so that they may have an impact at this frame */
    int *stale_discs;         /* each disc whose path was changed by an impact after the disc's search at this frame */
    Index disc_count;
    Index wall_count;
    Index path_count;
    Index stale_count;
    MotionKind motion;
    double gx; /* gravity */
    double gy;
    double rolling_resistance; /* coefficient of rolling resistance of discs on walls; used only under gravity */
    double deceleration;       /* deceleration of discs by the table, in metres per second squared */
    Damping damping;
    Clock clock;
    /* time of the present frame; with damping, its undamped time */
    double now;
    /* time of the present frame by the clock; with damping, the time that results report */
    double reported;
    /* time before which no disc can have an impact */
    double next_due;
    /* whether no impact was found at the last tested frame */
    bool is_settled;
    /* duration, in seconds, of the largest number of frames for which a bound of a disc's next impact is used */
    double frame_span;
    /* longest time from now for which a bound of a disc's next impact is used, in seconds; with damping, shorter than
       `frame_span` */
    double horizon;
    /* magnitude of gravity, rounded up */
    double pull;
    /* an upper bound of all coordinates and radii of walls */
    double wall_size;
    /* length, in metres, that `extent_of` adds for gravity and for driven bodies */
    double extra_extent;
    /* whether tests that cannot find an impact are skipped */
    bool skips;
    /* while all pairs are tested: the disc whose tests are next; 0 between frames */
    Index row;
    /* work that skipping tests has cost, minus work that it has saved; the unit is one test of two discs */
    double excess;
    double first_search; /* work of scheduling all discs once, in tests of two discs */
    double max_waste;    /* largest allowed `excess`, as a multiple of `first_search` */
    bool pays_back;      /* whether all tests are made at each frame, because `excess` was too large and is not yet 0 */
    double work;         /* work that this call of `carom_pit_run` may still do; the unit is one test of two discs */
    bool is_out_of_memory;
    /* whether two discs have met so far from the origin that the normal cannot be computed: see
       `are_distinguishable` */
    bool is_too_far;
    Law law;
    Counts counts;
    Grid grid;
    Pending pending;
    Touching touching;
    Record record;
    double steps[MAX_STEPS]; /* lengths of the steps to the next frames, in seconds */
    double times[MAX_STEPS]; /* times of the next frames */
} State;

/* ---- functions for bindings, in the order of calls ---- */

/* Set the sizes of a run. Return the required number of bytes, or 0 if there are too many discs and walls. */
size_t carom_pit_set_up(State *s, const RunInput *input);

/* Fill the memory of a run, which must begin at a cache line. */
void carom_pit_begin(State *s, const RunInput *input, void *memory);

/* Compute all frames with numbers below `until`. Stop earlier if `State.work` is used up, if there is no more memory,
   or after `most` impacts. */
void carom_pit_run(State *s, Index until, Index most);

/* Write x, y, vx, vy of each disc at a time that is not before the last frame. With damping, `time` is an undamped time
   and the velocities are undamped. */
void carom_pit_write_states(const State *s, double time, double *states);
