/* State of an event-driven run: discs, predictions, cells, queue, driven bodies and counts. Start here.

   Units are metres, metres a second and kilograms. A `time` is in seconds since the present epoch, unless a comment says
   since the start: see `Clock`. An obstacle is what a disc can meet of the walls: a wall, if all walls are half-planes
   with the coefficients of the law, else a feature of a wall (half-plane, face, vertex or arc).

   `event_driven.c` contains the loop. It takes the next event from the queue (`events.h`), applies it (`impacts.h`,
   `grid.h`), and predicts the discs that it changed again (`scan.h`, `obstacles.h`, `driven.h`). `motion.h` contains
   everything that depends on the shape of a path. */

#pragma once

#include "carom/core/accelerated.h"
#include "carom/core/carom_core.h"
#include "carom/core/constants.h"
#include "carom/core/feature.h"
#include "carom/core/run_input.h"
#include "carom/core/touched.h"

enum {
    NO_OBSTACLE = -1,
    NO_BODY = INT32_MIN, /* neither disc nor wall: the disc has met nothing yet */

    PLACES = 2,           /* for discs in a cell; further discs are in a chain, see `Cell` */
    MOST_COLUMNS = 32766, /* of a grid, and most rows: with the ring around, 16 bits number each */
    COLUMN_BITS = 16,
    COLUMN_MASK = 0xFFFF,
    MOST_OBSTACLES = 67108863, /* 26 bits of `Prediction.obstacle` */
    OUTWARD = 2,    /* cells beyond the grid for which the lists of tiles at the rim are valid: a gas leaves a row empty */
    EMPTY_LIST = 0, /* places in `Grid.lists` */
    FULL_LIST = 1,

    SIBLINGS = 8, /* times that a match of the event queue compares: a cache line */
    LEVELS = 11,  /* of the event queue: 8^10 discs are 10^9 */
    BATCH = 64,   /* discs that a scan processes at once: nine cells of two places hold 18 */
    LANES = 4,    /* candidates whose times are bounded together */
};

/* ---- events ---- */

typedef enum Edge { /* of a cell */
    NO_EDGE = -1,
    LEFT = 0,
    RIGHT = 1,
    DOWN = 2,
    UP = 3,
    MOTION_END = 4, /* no edge: the motion of a disc that accelerates ends before it reaches one */
} Edge;

typedef enum EventKind { /* of a disc's next event */
    START = 0,           /* of an epoch: the disc has no prediction */
    CROSSING = 1,        /* it leaves its cell */
    STALE = 2,           /* an impact with a disc whose path has changed since it was predicted */
    BOUNDED = 3,         /* an impact with a disc of which only a lower bound of the time is known */
    PAIR_IMPACT = 4,     /* an impact with a disc at a known time */
    WALL_IMPACT = 5,     /* an impact with an obstacle at a known time */
    POSTPONED = 6,       /* none yet: its time is later than its bound was */
    MOTION_ENDS = 7,     /* its mode of contact ends, or it stops on a table */
} EventKind;

typedef enum Change { /* what an event changes in a disc's future */
    OF_PATH = 0,      /* everything */
    OF_PARTNER = 1,   /* its next impact */
    OF_CELL = 2,      /* three more cells are near it, and it will leave another one */
    OF_TIME = 3,      /* only the time of its next event in the queue */
} Change;

typedef enum Ending { /* of a call of the loop; run.py has the same numbers */
    NOT_ENDED = -1,
    DONE = 0,         /* no impact is left up to the requested time */
    LIMIT = 1,        /* an impact is left, but the requested number has been reached */
    STANDSTILL = 2,   /* time no longer advances */
    PAUSE = 3,        /* the requested number of events has been processed */
    NO_MEMORY = 4,    /* for recorded impacts or for cells */
    GLIDES = 5,       /* a disc begins to glide along an arc: contact, and no impact */
    CRUSHED = 6,      /* a disc has no space left before the end */
    OUTGROWN = 7,     /* new cells are needed, since discs have moved beyond the present ones: see `choose_cells_again` */
    AT_REST = 8,      /* a disc rests on what does not move; the four of these name contact that is not solved */
    PRESSED = 9,      /* two discs stay in touch */
    CORNER = 10,      /* a disc is held by two walls */
    EDGE = 11,        /* a disc comes to the end of a face, too slowly to fly off */
} Ending;

typedef struct Event {
    EventKind kind;
    Index disc;
} Event;

/* ---- discs ---- */

typedef struct Disc { /* 64 bytes, one cache line: all that the prediction of a neighbour reads */
    double x;         /* centre at `time` */
    double y;
    double vx; /* velocity */
    double vy;
    double time; /* own time: that of its last impact; 0 without one in this epoch, or if it never moves */
    double radius;
    double inverse_mass; /* 0: it never moves */
    int impacts;         /* number of its impacts: identifies stale predictions */
    int last;            /* disc that it met last, or -1 - that obstacle, or NO_BODY */
} Disc;

typedef struct Prediction { /* 32 bytes: what comes next for a disc */
    double impact_time;     /* when it meets `partner`: the time itself if `exact`, else a lower bound; INF for never */
    double exit_time;       /* when it crosses `edge`, or meets `obstacle` before that */
    int partner;            /* disc, or NOBODY */
    int partner_impacts;    /* `impacts` of the partner at the time of the prediction */
    int cell;               /* its cell: row << COLUMN_BITS | column, the ring around the grid included */
    signed int obstacle : 27; /* met at `exit_time`; NO_OBSTACLE if it crosses an edge then */
    signed int edge : 4;      /* crossed at `exit_time`; NO_EDGE if it meets an obstacle then */
    unsigned int exact : 1;   /* whether `impact_time` is the time itself */
} Prediction;

/* ---- driven bodies ---- */

typedef struct Leg { /* of a driven body's path */
    double begin;    /* since the epoch */
    double end;      /* INF for the last */
    double begins;   /* the same two since the start */
    double ends;
    double moved_x; /* displacement of the body when it begins, metres */
    double moved_y;
    double vx;
    double vy;
} Leg;

typedef struct Driven { /* a driven body, or a wall with a moving surface */
    Index body;         /* disc, or -1 - that wall */
    Index first_leg;    /* of its path */
    Index leg_count;    /* 0 if only its surface moves */
    Index first_feature; /* of a wall */
    Index feature_count;
    double x; /* of a disc: its centre at the start */
    double y;
    double belt; /* of a wall: see `Surface` */
} Driven;

typedef struct Driving {
    Driven *rows; /* walls, then discs, each in ascending order */
    Leg *legs;
    Index count; /* of rows */
    Index leg_count;
} Driving;

typedef struct ToAndFro { /* how often in a row a disc has struck two exactly opposite bodies in turn */
    int last;             /* body that it struck last, or NO_BODY */
    int last_obstacle;    /* the obstacle of that body, NO_OBSTACLE for a disc */
    int across;           /* the same two of the opposite body */
    int across_obstacle;
    double nx; /* unit vector from the last body to the disc */
    double ny;
    Index row; /* number of impacts in a row */
} ToAndFro;

typedef struct Crush { /* of a disc that has no space left */
    Index disc;
    Index between[2]; /* bodies that close in on it, or on the row of discs that it is in */
    double time;      /* when its space is used up */
} Crush;

/* ---- cells ---- */

typedef struct Cell { /* 8 bytes */
    int disc[PLACES]; /* NOBODY if empty; CHAINED - i in the last place if a chain follows, which begins with disc i */
} Cell;

enum { CHAINED = -2 };

typedef struct Box {
    double left;
    double right;
    double low;
    double high;
} Box;

typedef struct Grid { /* of square cells, inside a ring of cells that stay empty */
    Cell *cells;      /* row by row, with the ring */
    int *chain;       /* the disc that follows a disc in its cell's chain, or NOBODY */
    unsigned int *list_of; /* of a tile: twice the place in `lists` where its obstacles begin, plus 1 for a tile at the rim;
                              0 for a tile far from all obstacles */
    int *lists;            /* numbers of obstacles, ascending, with NO_OBSTACLE at the end of each list: see obstacles.h */
    Index listed;          /* numbers in `lists` */
    Index list_capacity;
    void *own_memory; /* of cells that were chosen during the run; NULL for the first ones, which are in the arena */
    size_t own_size;
    Box area;  /* in which the lists are valid */
    double x0; /* lower left corner of the first cell inside the ring */
    double y0;
    double width;      /* of a cell */
    double radius;     /* of the largest disc */
    double reach;      /* the largest sum of two radii */
    double factor;     /* on the width of a cell */
    double extent;     /* upper bound of the obstacles' coordinates */
    Index predictions; /* `Counts.predictions` when the cells were chosen */
    Index beyond;      /* likewise `Counts.beyond` */
    Index beyond_limit; /* how much `Counts.beyond` may grow before the cells are chosen again */
    Index columns;      /* without the ring */
    Index rows;
    Index stride; /* from a cell to the one above it */
    Index tiles;  /* in a row: see `tile_of` in grid.h */
    int tile_bits; /* a tile is two to this power of cells wide */
} Grid;

typedef struct Block { /* of cells that a scan looks through: lines of three */
    Index first;
    Index lines;
    Index to_line; /* from a line to the next */
    Index to_cell; /* from a cell of a line to the next */
} Block;

/* ---- scan for a disc's next impact ---- */

typedef struct Candidate { /* a possible next impact of a disc */
    double low;            /* bounds of its time, equal if it is exact; INF for never */
    double high;
    Index partner;
} Candidate;

typedef struct Candidates { /* of a scan, in columns; one entry after the last may be overwritten */
    int disc[BATCH + LANES];
    double dx[BATCH + LANES]; /* centre relative to the scanning disc, at `start` */
    double dy[BATCH + LANES];
    double ux[BATCH + LANES]; /* velocity relative to it */
    double uy[BATCH + LANES];
    double reach[BATCH + LANES]; /* sum of the radii */
    double start[BATCH + LANES]; /* the later of the two discs' own times */
    double start_low[BATCH + LANES]; /* with acceleration: its low part */
    double low[BATCH + LANES];   /* bounds of the time of impact, as in `Candidate` */
    double high[BATCH + LANES];
} Candidates;

/* ---- event queue ---- */

typedef struct Queue { /* a tournament of next events; level 0 has one time a disc, the top level the least of all */
    double *time;
    int *holder;         /* the disc that each time belongs to, in the same places; from level 1 on */
    Index level[LEVELS]; /* where each level begins in `time` and `holder` */
    Index top;           /* number of the top level */
    Index discs;
} Queue;

/* ---- the run ---- */

typedef struct Clock { /* a time since the start is epoch + (epoch_rest + time) */
    double now;        /* of the last impact */
    double now_low;    /* with acceleration: its low part, see instant.h */
    double epoch;
    double epoch_rest;
    double reported; /* time of the last impact since the start, never less than the one before */
} Clock;

typedef struct Counts {
    Index impacts; /* since the start */
    Index wall_impacts;
    Index predictions; /* of discs after impacts */
    Index stale;
    Index crossings;
    Index beyond;        /* checks of all features, for a disc beyond the area of the lists */
    Index choices;       /* of cells during the run; those of the start are not counted */
    Index epochs;        /* begun */
    Index epoch_impacts; /* in this epoch */
    Index at_instant;    /* impacts since time last advanced */
    Index ambiguous_in_row; /* with acceleration: ambiguous impacts since the last that was not */
    Index has_begun;        /* with acceleration: whether discs that lie on walls at the start are in contact */
    Index predicted;     /* discs that have a prediction in this epoch */
    Index too_far;       /* impacts so far out that floats do not resolve the distance of the centres: the run is refused */
} Counts;

typedef struct State { /* all that a run consists of */
    Disc *discs;
    Prediction *predictions;
    Wall *walls;         /* the obstacles, if all are half-planes with the coefficients of `law`: then without features */
    Feature *features;   /* the obstacles otherwise: those of each wall in turn, in their order; a half-plane is one */
    Law *wall_laws;      /* with features: the law of each wall */
    double *last_impact; /* time of each disc's, for the TC model only */
    Turning *turning;    /* of each disc; NULL if no disc spins */
    Index disc_count;
    Index wall_count;
    Index feature_count;
    Index gliding;            /* the disc that glides, after `GLIDES` */
    Index standstill;         /* number of impacts at one instant after which time no longer advances */
    bool has_acceleration;    /* whether there is gravity or a table: see `Accelerated` */
    bool has_touched;         /* whether some impact has restitution 0: see touched.h */
    bool needs_prefetch;      /* whether memory is prefetched: see prefetch.h */
    bool has_special_paths;   /* whether there are features or driven bodies: `predict_special` predicts them */
    bool solves_all_pairs;    /* whether `all_pairs.h` advances the run */
    bool has_special_impacts; /* whether there are spins, features or driven bodies: `apply_special_impact` applies them */
    Clock clock;
    Law law;
    Counts counts;
    Grid grid;
    Queue queue;
    Candidates candidates;
    Record record;
    Box visited; /* where the discs began, and where they have struck features: their paths turn there */
    Driving driving;
    ToAndFro *to_and_fro; /* of each disc; NULL if no body is driven */
    TouchedBodies *touched; /* of each disc; NULL unless some impact has restitution 0 */
    Accelerated accelerated;
    Resize resize;  /* of `Grid.lists` and `Grid.own_memory` */
    Ending stopped; /* how an impact has ended the run */
    double until;   /* latest requested end, since the start: what would be crushed later is not crushed */
    Crush crush;    /* after `CRUSHED`; its time is counted from the start */
} State;

/* ---- functions for bindings ---- */

/* Set the sizes of a run; return how many bytes of memory it needs, 0 if there are too many discs or obstacles. */
size_t carom_set_up(State *s, const RunInput *input);

/* Fill the memory of a run, which begins at a cache line; return whether there was memory for the lists of obstacles. */
bool carom_begin(State *s, const RunInput *input, void *memory);

/* Apply impacts up to and including `until` (since the start), until there have been `impacts`, or for about `events`
   events; return how that ended, one of `Ending` other than NOT_ENDED and OUTGROWN. */
Ending carom_advance(State *s, double until, Index impacts, Index events);

/* Record impacts reported from `begin` to `end` (since the start) from now on. `recent` is one row a disc. */
void carom_record(State *s, Recent *recent, double begin, double end);

/* Predict everything again, after discs, clock and counts were set to those of an earlier run. */
void carom_resume(State *s);

/* Write x, y, vx and vy of each disc at a time since the epoch; with acceleration that time has a low part. */
void carom_states(const State *s, double time, double time_low, double *states);

/* Write the spin of each disc at that time; some disc spins, or accelerates. */
void carom_spins(const State *s, double time, double time_low, double *spins);

/* Write the number of impacts of each disc. */
void carom_impact_counts(const State *s, int64_t *counts);

/* Return the wall along which a disc glides, after `GLIDES`. */
Index carom_gliding_wall(const State *s);

/* Return how many bytes were allocated outside of the arena and of the record. */
size_t carom_allocated(const State *s);

/* Release the memory that was allocated outside of the arena and of the record. */
void carom_release(State *s);
