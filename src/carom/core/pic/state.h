/* State of an event-driven run: discs, predictions, cells, queue, driven bodies and counts. Read this file before the
   other headers of PIC.

   Units are metres, metres per second and kilograms. A `time` is in seconds since the present epoch, unless its comment
   states "since the start"; see `Clock`. An obstacle is anything, except a disc, that a disc can hit. Obstacles are the
   walls if all walls are half-planes with the coefficients of the law. Otherwise they are the features of the walls
   (half-planes, faces, vertices and arcs).

   `event_loop.c` contains the loop. It takes the next event from the queue (`next_event.h`) and applies it
   (`straight_impact.h`, `pic/grid.h`). Then it predicts the changed discs again (`straight_partner.h`,
   `obstacle_lists.h`, `driven_impact.h`). `straight_motion.h` and `parabola_motion.h` contain the functions that depend
   on the shape of a path.
   */

#pragma once

#include "carom/core/pic/accelerated_state.h"
#include "carom/core/run_input.h"
#include "carom/core/touched_bodies.h"

enum {
    NO_OBSTACLE = -1,
    NO_BODY = INT32_MIN, /* the disc has hit nothing yet */

    PLACES = 2,           /* number of places for discs in a cell; further discs are in a chain, see `Cell` */
    /* largest number of columns and of rows of a grid. With the ring of empty cells, the number of a column or row has
       16 bits */
    MOST_COLUMNS = 32766,
    COLUMN_BITS = 16,
    COLUMN_MASK = 0xFFFF,
    MOST_OBSTACLES = 67108863, /* obstacle numbers have 26 bits, see `Prediction.obstacle` */
    OUTWARD = 2,    /* the lists of tiles at the rim are also valid in this number of cells beyond the grid */
    EMPTY_LIST = 0, /* `EMPTY_LIST` and `FULL_LIST` are indices in `Grid.lists` */
    FULL_LIST = 1,

    SIBLINGS = 8, /* number of times that a match of the event queue compares: one cache line */
    LEVELS = 11,  /* of the event queue: enough for 8^10 (about 10^9) discs */
    BATCH = 64,   /* number of discs that a scan processes at once; nine cells with two places each hold 18 */
    LANES = 4,    /* number of candidates whose times are bounded together */
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
    START = 0,           /* the disc has no prediction in this epoch */
    CROSSING = 1,        /* the disc leaves its cell */
    STALE = 2,           /* impact with a disc whose path has changed since the prediction */
    BOUNDED = 3,         /* impact with a disc; only a lower bound of its time is known */
    PAIR_IMPACT = 4,     /* impact with a disc at a known time */
    WALL_IMPACT = 5,     /* impact with an obstacle at a known time */
    POSTPONED = 6,       /* no event yet: the disc's next event may be later than the lower bound of its time was */
    MOTION_ENDS = 7,     /* the disc's mode of contact ends, or the disc stops on a table */
} EventKind;

typedef enum Change { /* which predictions of a disc an event makes invalid */
    OF_PATH = 0,      /* everything */
    OF_PARTNER = 1,   /* its next impact with a disc */
    OF_CELL = 2,      /* the disc is in another cell, so three more cells are near it */
    OF_TIME = 3,      /* only the disc's time in the queue */
} Change;

typedef enum Ending { /* how a call of the loop ends; run.py has the same numbers */
    NOT_ENDED = -1,
    DONE = 0,         /* no impact remains up to the requested time */
    LIMIT = 1,        /* an impact remains, but the requested number of impacts is reached */
    STANDSTILL = 2,   /* time no longer advances */
    PAUSE = 3,        /* the requested number of events is processed */
    NO_MEMORY = 4,    /* no memory for recorded impacts or for cells */
    GLIDES = 5,       /* a disc begins to glide along an arc: contact without an impact */
    CRUSHED = 6,      /* a disc has no space left before the requested end */
    OUTGROWN = 7,     /* discs have left the present cells, so new ones are needed: see `choose_cells_again` */
    /* a disc rests on a body that does not move. This ending and the next three are due to contacts that PIC does not
       solve */
    AT_REST = 8,
    PRESSED = 9,      /* two discs stay in contact */
    CORNER = 10,      /* a disc is wedged between two walls */
    EDGE = 11,        /* a disc reaches the end of a face too slowly to fly off */
} Ending;

typedef struct Event {
    EventKind kind;
    Index disc;
} Event;

/* ---- discs ---- */

typedef struct Disc { /* 64 bytes, one cache line, with all data that predictions of neighbours read */
    double x;         /* centre at `time` */
    double y;
    double vx; /* velocity */
    double vy;
    /* when the present path began: at the last impact in this epoch; 0 if there was none, or if the disc never moves */
    double time;
    double radius;
    double inverse_mass; /* 0 for a disc that never moves */
    int impacts;         /* number of its impacts; predictions of other discs are stale if this number has changed */
    int last;            /* the disc that it hit last, or -1 - k for obstacle k, or NO_BODY */
} Disc;

typedef struct Prediction { /* 32 bytes: the next impact of a disc, and when it leaves its cell */
    double impact_time;     /* when it hits `partner`; a lower bound unless `exact`; INF for never */
    double exit_time;       /* when it crosses `edge`, or hits `obstacle` before that */
    int partner;            /* disc, or NOBODY */
    int partner_impacts;    /* the partner's `impacts` at the time of the prediction */
    int cell;               /* row << COLUMN_BITS | column of its cell, both counted from the ring around the grid */
    signed int obstacle : 27; /* obstacle hit at `exit_time`; NO_OBSTACLE if the disc crosses an edge then */
    signed int edge : 4;      /* edge crossed at `exit_time`; NO_EDGE if the disc hits an obstacle then */
    unsigned int exact : 1;   /* whether `impact_time` is the exact time and not a bound */
} Prediction;

/* ---- driven bodies ---- */

typedef struct Driven { /* a driven body, or a wall with a moving surface */
    Index body;         /* disc i as i, wall k as -1 - k */
    Index first_leg;    /* of its path, in `Driving.legs` */
    Index leg_count;    /* 0 if only the surface moves */
    Index first_feature; /* of a wall */
    Index feature_count;
    double x; /* of a disc: centre at the start */
    double y;
    double belt; /* of a wall; see `Surface` */
} Driven;

typedef struct Driving {
    Driven *rows; /* walls, then discs, each in ascending order */
    Leg *legs;
    Index count; /* number of rows */
    Index leg_count;
} Driving;

typedef struct ToAndFro { /* how many times in succession a disc has hit two exactly opposite bodies alternately */
    int last;             /* body that it hit last, or NO_BODY */
    int last_obstacle;    /* obstacle of that body; NO_OBSTACLE for a disc */
    int across;           /* the same two numbers for the opposite body */
    int across_obstacle;
    double nx; /* unit vector from the last body to the disc */
    double ny;
    Index row; /* number of such impacts in succession */
} ToAndFro;

typedef struct Crush { /* a disc that has no space left */
    Index disc;
    Index between[2]; /* the bodies that close in on it, or on the row of discs that contains it */
    double time;      /* when no space is left */
} Crush;

/* ---- cells ---- */

typedef struct Cell { /* 8 bytes */
    /* NOBODY if empty; CHAINED - i in the last place if the cell also has a chain, which begins with disc i */
    int disc[PLACES];
} Cell;

enum { CHAINED = -2 };

typedef struct Box {
    double left;
    double right;
    double low;
    double high;
} Box;

typedef struct Grid { /* square cells, surrounded by a ring of cells that stay empty */
    Cell *cells;      /* row by row, including the ring */
    int *chain;       /* for each disc the next disc in its cell's chain, or NOBODY */
    /* for each tile: twice the index in `lists` of its first obstacle, plus 1 for a tile at the rim; 0 if it is far
       from all obstacles */
    unsigned int *list_of;
    int *lists;            /* numbers of obstacles, ascending; NO_OBSTACLE ends each list. See obstacle_lists.h */
    Index listed;          /* count of numbers in `lists` */
    Index list_capacity;
    /* memory of cells that were chosen during the run; NULL for the first cells, which are in the arena */
    void *own_memory;
    size_t own_size;
    Box area;  /* box in which the lists are valid */
    double x0; /* lower left corner of the first cell inside the ring */
    double y0;
    double width;      /* of a cell */
    double radius;     /* of the largest disc */
    double reach;      /* the largest sum of two radii */
    double factor;     /* factor on the width of a cell */
    double extent;     /* upper bound of the obstacles' coordinates */
    Index predictions; /* `Counts.predictions` when the cells were chosen */
    Index beyond;      /* `Counts.beyond` when the cells were chosen */
    Index beyond_limit; /* largest increase of `Counts.beyond` before the cells are chosen again */
    Index columns;      /* without the ring */
    Index rows;
    Index stride; /* from a cell to the one above it */
    Index tiles;  /* number of tiles in a row; see `tile_of` in pic/grid.h */
    int tile_bits; /* a tile is 2^tile_bits cells wide */
} Grid;

typedef struct Block { /* cells that a scan searches: lines of three cells */
    Index first;
    Index lines;
    Index to_line; /* step from a line to the next */
    Index to_cell; /* step from a cell of a line to the next */
} Block;

/* ---- scan for a disc's next impact ---- */

typedef struct Candidate { /* possible next impact of a disc with `partner` */
    double low;            /* bounds of the impact's time; equal if the time is exact; INF for never */
    double high;
    Index partner;
} Candidate;

typedef struct Candidates { /* candidates of a scan, in columns; the entry after the last one may be overwritten */
    int disc[BATCH + LANES];
    double dx[BATCH + LANES]; /* centre relative to the scanning disc, at `start` */
    double dy[BATCH + LANES];
    double ux[BATCH + LANES]; /* velocity relative to it */
    double uy[BATCH + LANES];
    double reach[BATCH + LANES]; /* sum of the radii */
    double start[BATCH + LANES]; /* the later of the two discs' own times */
    double start_low[BATCH + LANES]; /* low part of `start`, with acceleration */
    double low[BATCH + LANES];   /* bounds of the time of impact, as in `Candidate` */
    double high[BATCH + LANES];
} Candidates;

/* ---- event queue ---- */

/* tournament tree: level 0 has one time per disc, and the top level has the earliest of all times */
typedef struct Queue {
    double *time;
    int *holder;         /* for levels 1 and up, the disc that each time belongs to, at the same index */
    Index level[LEVELS]; /* index in `time` and `holder` at which each level begins */
    Index top;           /* number of the top level */
    Index discs;
} Queue;

/* ---- the run ---- */

typedef struct Clock { /* a time since the start is epoch + (epoch_rest + time) */
    double now;        /* time of the last impact */
    double now_low;    /* its low part, with acceleration; see arithmetic/double_double.h */
    double epoch;
    double epoch_rest;
    double reported; /* time of the last impact since the start; it never decreases */
} Clock;

typedef struct Counts {
    Index impacts; /* since the start */
    Index wall_impacts;
    Index predictions; /* predictions of discs after impacts */
    Index stale;
    Index crossings;
    Index beyond;        /* checks of all features for a disc outside the area of the lists */
    Index choices;       /* of new cells during the run */
    Index epochs;        /* epochs begun */
    Index epoch_impacts; /* in this epoch */
    Index at_instant;    /* impacts since time last advanced */
    Index still_impacts; /* impacts in successive epochs in which no disc has moved */
    Index ambiguous_in_row; /* with acceleration: ambiguous impacts in succession */
    Index has_begun; /* with acceleration: whether discs that touch walls at the start have been put in contact */
    Index predicted;     /* discs that have a prediction in this epoch */
    /* impacts so far from the origin that floats do not resolve the distance of the centres; callers refuse such a
       run */
    Index too_far;
} Counts;

typedef struct State { /* all data of a run */
    Disc *discs;
    Prediction *predictions;
    Wall *walls; /* the obstacles if all are half-planes with the coefficients of `law`; there are no features then */
    Feature *features;   /* if there are no `walls`, the obstacles: the features of all walls, wall by wall */
    Law *wall_laws;      /* the law of each wall, if there are features */
    double *last_impact; /* time of each disc's last impact, for the TC model only */
    Turning *turning;    /* of each disc; NULL if no disc spins */
    Index disc_count;
    Index wall_count;
    Index feature_count;
    Index gliding;            /* the gliding disc, after `GLIDES` */
    Index standstill;         /* more impacts than this at one instant stop the run, because time no longer advances */
    bool has_acceleration;    /* whether there is gravity or a decelerating table: see `Accelerated` */
    bool has_touched;         /* whether some impact has restitution 0: see touched_bodies.h */
    bool needs_prefetch;      /* whether memory is prefetched: see prefetch.h */
    bool has_special_paths;   /* whether there are features or driven bodies; if so, `predict_special` predicts */
    bool solves_all_pairs;    /* whether `all_pairs.h` advances the run */
    /* whether there are spins, features or driven bodies; if so, `apply_special_impact` applies impacts */
    bool has_special_impacts;
    Clock clock;
    Law law;
    Counts counts;
    Grid grid;
    Queue queue;
    Candidates candidates;
    Record record;
    Box visited; /* box around the start positions and around all impacts on features */
    Driving driving;
    ToAndFro *to_and_fro; /* of each disc; NULL if no body is driven */
    TouchedBodies *touched; /* of each disc; NULL unless some impact has restitution 0 */
    Accelerated accelerated;
    Resize resize;  /* for `Grid.lists` and `Grid.own_memory` */
    Ending stopped; /* ending that an impact has caused */
    double until;   /* latest requested end, since the start. Crushes later than this do not end the run */
    Crush crush;    /* set if the ending is `CRUSHED`; `time` is since the start here */
} State;

/* ---- functions for bindings ---- */

/* Set the sizes of a run. Return the number of bytes that it needs, or 0 if there are too many discs or obstacles. */
size_t carom_set_up(State *s, const RunInput *input);

/* Fill the memory of a run, which must begin at a cache line. Return false if there is no memory for the lists of
   obstacles. */
bool carom_begin(State *s, const RunInput *input, void *memory);

/* Apply impacts until one of three limits is reached: the time `until` (since the start), at which impacts are still
   applied; `impacts` impacts in the whole run; or about `events` events in this call. Return the `Ending`, which is
   never NOT_ENDED or OUTGROWN. */
Ending carom_advance(State *s, double until, Index impacts, Index events);

/* From now on, record all impacts whose reported times are from `begin` to `end` (since the start). `recent` has one
   row per disc. */
void carom_record(State *s, Recent *recent, double begin, double end);

/* Make all predictions again, after discs, clock and counts have been set to those of an earlier run. */
void carom_resume(State *s);

/* Write x, y, vx and vy of each disc at a time since the epoch. With acceleration this time has a low part. */
void carom_states(const State *s, double time, double time_low, double *states);

/* Write the spin of each disc at a time since the epoch. In the run, discs must spin or accelerate. */
void carom_spins(const State *s, double time, double time_low, double *spins);

/* Write the number of impacts of each disc. */
void carom_impact_counts(const State *s, int64_t *counts);

/* Return the wall along which a disc glides, after `GLIDES`. */
Index carom_gliding_wall(const State *s);

/* Return the number of bytes allocated outside of the arena and of the record. */
size_t carom_allocated(const State *s);

/* Free the memory that was allocated outside of the arena and of the record. */
void carom_release(State *s);
