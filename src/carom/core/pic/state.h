/* State of an event-driven run: discs, predictions, cells, queue, driven bodies and counts. Read this file before the
   other headers of PIC.

   Units are metres, metres per second and kilograms. A `time` is in seconds since the present epoch, unless its comment
   states "since the start"; see `Clock`. Obstacles are what a disc can hit, except other discs. The obstacles are the
   walls if all walls are half-planes with the same coefficients, no body is driven and no disc accelerates. Otherwise
   the obstacles are the features of the walls (half-planes, faces, vertices and arcs).

   `event_loop.c` contains the loop. The loop takes the next event from the queue (`next_event.h`) and applies it
   (`straight_impact.h`, `pic/grid.h`). Then the loop predicts the events of the changed discs again
   (`straight_partner.h`, `obstacle_lists.h`, `driven_impact.h`). `straight_motion.h` and `parabola_motion.h` contain
   the functions for the two shapes of a path. `few_bodies.h` contains a faster loop for few discs and walls.
 */

#pragma once

#include "carom/core/pic/accelerated_state.h"
#include "carom/core/run_input.h"
#include "carom/core/pic/touched_bodies.h"

enum {
    NO_OBSTACLE = -1,
    NO_BODY = INT32_MIN, /* the disc has hit nothing yet */

    /* number of discs that a cell stores itself; further discs are in a linked list, its chain: see `Cell` */
    PLACES = 2,
    /* largest number of columns and of rows of a grid. The number of a column or row has 16 bits, and the ring of empty
       cells around the grid adds two columns and two rows */
    MOST_COLUMNS = 32766,
    COLUMN_BITS = 16,
    COLUMN_MASK = 0xFFFF,
    MOST_OBSTACLES = 67108863, /* obstacle numbers have 26 bits, see `Prediction.obstacle` */
    /* the lists of obstacles of tiles at the rim are also valid up to this number of cell widths beyond the grid */
    OUTWARD = 2,
    EMPTY_LIST = 0, /* `EMPTY_LIST` and `FULL_LIST` are indices in `Grid.lists` */
    FULL_LIST = 1,

    SIBLINGS = 8, /* number of times that a match of the event queue compares: they fill one cache line */
    LEVELS = 11,  /* number of levels of the event queue: enough for 8^10 (about 10^9) discs */
    /* number of discs that a search for the next impact (a scan) processes at once. Without chains, the nine cells of a
       search contain at most 18 discs */
    BATCH = 64,
    LANES = 4,    /* number of candidates whose times of impact are bounded together by vector instructions */
    /* largest numbers of discs and walls for which the loop of few_bodies.h is used, multiples of LANES. The loop takes
       .65 times as long as the other one for 16 discs, and 1.2 times as long for 25 discs */
    MOST_FEW_DISCS = 16,
    MOST_FEW_WALLS = 8,
};

/* ---- events ---- */

typedef enum Edge { /* edge of a cell */
    NO_EDGE = -1,
    LEFT = 0,
    RIGHT = 1,
    DOWN = 2,
    UP = 3,
    MOTION_END = 4, /* no edge: the motion of an accelerating disc ends before the disc reaches an edge */
} Edge;

typedef enum EventKind { /* kind of a disc's next event */
    START = 0,           /* the disc needs its first prediction in this epoch */
    CROSSING = 1,        /* the disc leaves its cell */
    STALE = 2,           /* impact with a disc whose path has changed since the prediction */
    BOUNDED = 3,         /* impact with a disc; only a lower bound of its time is known */
    PAIR_IMPACT = 4,     /* impact with a disc at a known time */
    WALL_IMPACT = 5,     /* impact with an obstacle at a known time */
    /* no event to process now: the disc's next event is later than its time in the queue, which was a lower bound */
    POSTPONED = 6,
    MOTION_ENDS = 7,     /* the disc's mode of contact ends, or the disc stops on a table */
} EventKind;

typedef enum Change { /* which predictions of a disc must be computed again after an event */
    OF_PATH = 0,      /* all predictions, because the disc's path has changed */
    OF_PARTNER = 1,   /* only its next impact with a disc, because the partner's path has changed */
    /* the time at which it leaves its cell, and impacts with discs in three more cells, because it has entered another
       cell */
    OF_CELL = 2,
    OF_TIME = 3,      /* no prediction; only the disc's time in the queue must be updated */
} Change;

typedef enum Ending { /* how a call of the loop ends; solvers/event_driven/run.py uses the same numbers */
    NOT_ENDED = -1,
    DONE = 0,         /* no impact remains up to the requested time */
    LIMIT = 1,        /* an impact remains, but the requested number of impacts is reached */
    STANDSTILL = 2,   /* too many impacts occur while time does not advance */
    PAUSE = 3,        /* the requested number of events has been processed */
    NO_MEMORY = 4,    /* there is not enough memory for recorded impacts or for cells */
    GLIDES = 5,       /* a disc begins to glide along an arc: contact without an impact */
    CRUSHED = 6,      /* a disc has no space left before the requested end */
    /* discs have moved outside the grid of cells, so a larger grid may be better: see `choose_cells_again` */
    OUTGROWN = 7,
    /* a disc rests on a body that does not move. This ending and the next three are due to contacts that PIC does not
       solve */
    AT_REST = 8,
    PRESSED = 9,      /* two discs stay in contact, pressed together */
    CORNER = 10,      /* a disc is wedged between two walls */
    EDGE = 11,        /* a disc reaches the end of a face too slowly to fly off */
} Ending;

typedef struct Event {
    EventKind kind;
    Index disc;
} Event;

/* ---- discs ---- */

typedef struct Disc { /* 64 bytes, one cache line, with all data of the disc that predictions of other discs read */
    double x;         /* centre at `time`, in metres */
    double y;
    double vx; /* velocity */
    double vy;
    /* time at which the disc's present path began: its last impact in this epoch, or 0 if there was none. For a disc
       that never moves, `time` is always 0 */
    double time;
    double radius;
    double inverse_mass; /* 0 for a disc that never moves */
    /* number of the disc's impacts so far; another disc's predicted impact with it is stale if this number has changed
       since */
    int impacts;
    int last;            /* the last body hit: the number of a disc, -1 - k for obstacle k, or NO_BODY */
} Disc;

/* the predicted next impact of a disc with another disc, and when the disc leaves its cell; 32 bytes */
typedef struct Prediction {
    /* time at which the disc hits `partner`: exact, or a lower bound if `exact` is false; INF for never */
    double impact_time;
    double exit_time;       /* time at which the disc crosses `edge` of its cell, or hits `obstacle` before that */
    int partner;            /* the disc that it hits next, or NOBODY */
    int partner_impacts;    /* the partner's `impacts` at the time of the prediction */
    /* the disc's cell: row << COLUMN_BITS | column. The ring of empty cells is row 0 and column 0 */
    int cell;
    signed int obstacle : 27; /* obstacle hit at `exit_time`; NO_OBSTACLE if the disc crosses an edge then */
    signed int edge : 4;      /* edge crossed at `exit_time`; NO_EDGE if the disc hits an obstacle then */
    unsigned int exact : 1;   /* whether `impact_time` is the exact time and not a bound */
} Prediction;

/* ---- driven bodies ---- */

typedef struct Driven { /* a driven body, or a wall with a moving surface */
    Index body;         /* number of the body: i for disc i, -1 - k for wall k */
    Index first_leg;    /* index of the first leg of its path in `Driving.legs` */
    Index leg_count;    /* 0 if only the surface moves */
    Index first_feature; /* of a wall */
    Index feature_count;
    double x; /* for a disc: centre at the start of the run, in metres */
    double y;
    double belt; /* for a wall: speed of its surface, as in `Surface` */
} Driven;

typedef struct Driving {
    Driven *rows; /* one row per driven body: walls, then discs, both in ascending order */
    Leg *legs;
    Index count; /* number of entries in `rows` */
    Index leg_count;
} Driving;

/* a disc that bounces to and fro: how many times in succession it has hit two exactly opposite bodies alternately */
typedef struct ToAndFro {
    int last;             /* body that the disc hit last, or NO_BODY */
    int last_obstacle;    /* obstacle of the body `last`; NO_OBSTACLE if that body is a disc */
    int across;           /* the same two numbers for the body on the opposite side */
    int across_obstacle;
    double nx; /* unit vector from the last body to the disc */
    double ny;
    Index row; /* number of successive impacts on the two bodies */
} ToAndFro;

typedef struct Crush { /* a disc that two approaching bodies crush */
    Index disc;
    /* numbers of the two bodies that approach each other, with the disc, or a row of touching discs, between them */
    Index between[2];
    double time;      /* time at which no space is left between the two bodies */
} Crush;

/* ---- cells ---- */

typedef struct Cell { /* 8 bytes */
    /* numbers of discs; NOBODY in an empty place. If the cell also has a chain of further discs, the last place
       contains CHAINED - i, where i is the first disc of the chain */
    int disc[PLACES];
} Cell;

enum { CHAINED = -2 };

typedef struct Box {
    double left;
    double right;
    double low;
    double high;
} Box;

typedef struct Grid { /* a grid of square cells, surrounded by a ring of cells that stay empty */
    Cell *cells;      /* all cells, row by row, including the ring of empty cells */
    int *chain;       /* for each disc, the next disc in the chain of its cell, or NOBODY. */
    /* A tile is a block of cells with a common list of obstacles. Entry of each tile: 2 i, or 2 i + 1 for a tile at the
       rim, where i is the index in `lists` at which its list begins. 0 if the tile is far from all obstacles */
    unsigned int *list_of;
    /* the lists of all tiles, one after the other. A list contains the numbers of obstacles in ascending order and ends
       with NO_OBSTACLE: see obstacle_lists.h */
    int *lists;
    Index listed;          /* count of numbers in `lists` */
    Index list_capacity;
    /* memory of the present cells, if they were chosen during the run; NULL for the first cells, which are in the
       arena */
    void *own_memory;
    size_t own_size;
    Box area;  /* box in which the lists are valid */
    double x0; /* lower left corner of the first cell inside the ring */
    double y0;
    double width;      /* of a cell */
    double radius;     /* radius of the largest disc, in metres */
    double reach;      /* the largest sum of two radii */
    double factor;     /* the width of a cell is multiplied by this factor */
    double extent;     /* upper bound of the absolute coordinates of all obstacles, in metres */
    Index predictions; /* value of `Counts.predictions` when the present cells were chosen */
    Index beyond;      /* value of `Counts.beyond` when the present cells were chosen */
    Index beyond_limit; /* if `Counts.beyond` has increased by more than this, new cells are chosen */
    Index columns;      /* number of columns, without the ring of empty cells */
    Index rows;
    Index stride; /* step of the index from a cell to the cell above it */
    Index tiles;  /* number of tiles in a row of tiles; see `tile_of` in pic/grid.h */
    int tile_bits; /* a tile is 2^tile_bits cells wide */
} Grid;

typedef struct Block { /* cells in which a scan searches for discs: lines of three cells */
    Index first;
    Index lines;
    Index to_line; /* step of the index from a line to the next line */
    Index to_cell; /* step of the index from a cell of a line to the next cell */
} Block;

/* ---- scan for a disc's next impact ---- */

typedef struct Candidate { /* possible next impact of a disc with `partner` */
    double low;            /* lower and upper bound of the impact's time; equal if the time is exact; INF for never */
    double high;
    Index partner;
} Candidate;

/* candidates of a scan: entry k of all arrays belongs to candidate k. The entry after the last candidate may be
   overwritten */
typedef struct Candidates {
    int disc[BATCH + LANES];
    /* centre of the candidate relative to the disc whose next impact is searched, at `start` */
    double dx[BATCH + LANES];
    double dy[BATCH + LANES];
    double ux[BATCH + LANES]; /* velocity of the candidate relative to that disc */
    double uy[BATCH + LANES];
    double reach[BATCH + LANES]; /* sum of the radii */
    double start[BATCH + LANES]; /* the later of the two times at which the paths of the two discs began */
    double start_low[BATCH + LANES]; /* if discs accelerate: low part of `start` */
    double low[BATCH + LANES];   /* bounds of the time of impact, as in `Candidate` */
    double high[BATCH + LANES];
} Candidates;

/* ---- event queue ---- */

/* tournament tree of the times of next events: level 0 has one time per disc, and the top level has the earliest
   time */
typedef struct Queue {
    double *time;
    /* for each time on level 1 or higher, the disc to which it belongs, at the same index as in `time` */
    int *holder;
    Index level[LEVELS]; /* index in `time` and `holder` at which each level begins */
    Index top;           /* number of the top level */
    Index discs;
} Queue;

/* ---- few bodies ---- */

typedef struct FirstImpact { /* the predicted first impact of a disc: see few_bodies.h */
    double time;         /* exact, or a lower bound if `is_exact` is false; INF for never */
    double second;       /* lower bound of the times of the disc's other impacts */
    int body;            /* number of a disc, or -1 - k for wall k */
    int partner_impacts; /* if the body is a disc: its `impacts` at the time of the prediction */
    bool is_exact;
} FirstImpact;

/* copies of the rows of a run with few bodies. Each component has its own array, because vector instructions read
   several components at once */
typedef struct FewBodies {
    double x[MOST_FEW_DISCS];
    double y[MOST_FEW_DISCS];
    double vx[MOST_FEW_DISCS];
    double vy[MOST_FEW_DISCS];
    double start[MOST_FEW_DISCS]; /* `Disc.time` */
    double radius[MOST_FEW_DISCS];
    double wall_x[MOST_FEW_WALLS];
    double wall_y[MOST_FEW_WALLS];
    double wall_nx[MOST_FEW_WALLS];
    double wall_ny[MOST_FEW_WALLS];
    double time[MOST_FEW_DISCS]; /* `FirstImpact.time`; INF in an unused place and for a disc that never moves */
    FirstImpact first[MOST_FEW_DISCS];
    Index disc_places; /* number of discs, rounded up to a multiple of LANES */
    Index wall_places;
} FewBodies;

/* ---- the run ---- */

/* a time t since the present epoch is the time epoch + (epoch_rest + t) since the start of the run */
typedef struct Clock {
    double now;        /* time of the last impact, in seconds since the present epoch */
    double now_low;    /* if discs accelerate: low part of the instant `now`; see arithmetic/double_double.h */
    double epoch;
    double epoch_rest;
    double reported; /* time of the last impact in seconds since the start, which never decreases */
} Clock;

typedef struct Counts {
    Index impacts; /* number of impacts since the start of the run */
    Index wall_impacts;
    /* number of predictions that impacts have made necessary: one for each movable disc in an impact */
    Index predictions;
    Index stale;
    Index crossings;
    /* how often a prediction had to check all features, because the disc leaves the area in which the lists are
       valid */
    Index beyond;
    Index choices;       /* how often new cells were chosen during the run */
    Index epochs;        /* number of epochs that have begun during the run */
    Index epoch_impacts; /* number of impacts in this epoch */
    Index at_instant;    /* number of impacts since time last advanced */
    Index still_impacts; /* number of impacts in the last successive epochs in which no disc has moved */
    Index ambiguous_in_row; /* if discs accelerate: number of ambiguous impacts in succession */
    /* if discs accelerate: 1 after the contacts of discs that touch walls at the start have begun, otherwise 0 */
    Index has_begun;
    Index predicted;     /* number of discs that have a prediction in this epoch */
    /* number of impacts so far from the origin that the normal cannot be computed (see `are_distinguishable`). If there
       is one, callers raise an error */
    Index too_far;
} Counts;

typedef struct State { /* all data of a run */
    Disc *discs;
    Prediction *predictions;
    Wall *walls; /* the obstacles if there are no features: half-planes with the coefficients of `law` */
    Feature *features;   /* otherwise the obstacles: the features of all walls, wall by wall */
    Law *wall_laws;      /* the law of each wall, if there are features */
    double *last_impact; /* time of each disc's last impact; used only for the TC model (`Law.contact_duration`) */
    Turning *turning;    /* rotation of each disc; NULL if no disc spins and no disc accelerates */
    Index disc_count;
    Index wall_count;
    Index feature_count;
    Index gliding;            /* if a run ends with `GLIDES`: the disc that glides along an arc */
    /* largest number of impacts at one instant. More of them end the run with `STANDSTILL`, because time no longer
       advances */
    Index standstill;
    bool has_acceleration;    /* whether there is gravity or a decelerating table: see `Accelerated` */
    bool has_touched;         /* whether impacts between some bodies have restitution 0: see touched_bodies.h */
    bool needs_prefetch;      /* whether the run is so large that prefetching saves time: see prefetch.h */
    /* whether there are features or driven bodies, so that `predict_special` must predict events */
    bool has_special_paths;
    bool solves_all_pairs;    /* whether the all-pairs loop (all_pairs.h) advances the run */
    bool has_few_bodies;      /* whether the loop for few bodies (few_bodies.h) advances the run */
    /* whether there are spins, features or driven bodies, so that `apply_special_impact` must apply impacts */
    bool has_special_impacts;
    Clock clock;
    Law law;
    Counts counts;
    Grid grid;
    Queue queue;
    Candidates candidates;
    FewBodies few;
    Record record;
    Box visited; /* box around the start positions and around all impacts on features */
    Driving driving;
    ToAndFro *to_and_fro; /* successive impacts of each disc; NULL if no body is driven */
    TouchedBodies *touched; /* of each disc; NULL unless some impact has restitution 0 */
    Accelerated accelerated;
    Resize resize;  /* the caller's function that allocates `Grid.lists` and `Grid.own_memory` */
    Ending stopped; /* if an impact or a contact ends the run: how the run ends */
    /* latest end that a caller has requested, in seconds since the start. A crush after this end does not end the
       run */
    double until;
    Crush crush;    /* if a run ends with `CRUSHED`: the crush, whose `time` is in seconds since the start */
} State;

/* ---- functions for bindings ---- */

/* Set the sizes of a run. Return the number of bytes that it needs, or 0 if there are too many discs or obstacles. */
size_t carom_set_up(State *s, const RunInput *input);

/* Fill the memory of a run, which must begin at a cache line. Return false if there is no memory for the lists of
   obstacles. */
bool carom_begin(State *s, const RunInput *input, void *memory);

/* Apply impacts until one of three limits is reached: the time `until`, in seconds since the start; `impacts` impacts
   in the whole run; or about `events` events in this call. Impacts exactly at `until` are applied. Return the `Ending`,
   which is never NOT_ENDED or OUTGROWN. */
Ending carom_advance(State *s, double until, Index impacts, Index events);

/* From now on, record all impacts whose reported times are from `begin` to `end` (since the start). `recent` is memory
   for one row per disc. */
void carom_record(State *s, Recent *recent, double begin, double end);

/* Prepare to continue an earlier run, after the caller has copied its discs, clock and counts into `s`. All predictions
   are made again. */
void carom_resume(State *s);

/* Write x, y, vx and vy of each disc at a time since the present epoch. If discs accelerate, the time is `time` +
   `time_low`. */
void carom_states(const State *s, double time, double time_low, double *states);

/* Write the spin of each disc at a time since the present epoch. The function must be called only if discs spin or
   accelerate. */
void carom_spins(const State *s, double time, double time_low, double *spins);

/* Write the number of impacts of each disc. */
void carom_impact_counts(const State *s, int64_t *counts);

/* Return the wall along which a disc glides, after `GLIDES`. */
Index carom_gliding_wall(const State *s);

/* Return the number of bytes allocated outside of the arena and of the record. */
size_t carom_allocated(const State *s);

/* Free the memory that was allocated outside of the arena and of the record. */
void carom_release(State *s);
