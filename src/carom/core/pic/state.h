/* State of an event-driven run. Read this file before the other headers of PIC.

   Units are metres, metres per second and kilograms. Times are in seconds since the present epoch (a part of the run,
   see `Clock`), unless a comment says "since the start". An obstacle is a wall, or a part of a wall, that a disc can
   hit. If all walls are half-planes with the same coefficients, no body is driven and no disc accelerates, the
   obstacles are whole walls. In all other runs, the obstacles are the features (parts) of walls: half-planes, faces,
   vertices and arcs.

   The loop in `event_loop.c` takes the next event from a queue (`next_event.h`), applies it, and predicts the next
   events of the changed discs. `straight_motion.h` is for straight paths, and `parabola_motion.h` for parabolas.
   `few_bodies.h` contains a faster loop for few discs and walls.
 */

#pragma once

#include "carom/core/pic/accelerated_state.h"
#include "carom/core/run_input.h"
#include "carom/core/pic/touched_bodies.h"

enum {
    NO_OBSTACLE = -1,
    /* the disc has hit nothing yet */
    NO_BODY = INT32_MIN,

    /* number of discs that a cell stores itself; a linked list (its chain) contains any further discs */
    PLACES = 2,
    /* largest number of columns, and of rows, in a grid. The number of a column or row has 16 bits, and the ring of
       empty cells around the grid takes two columns and two rows */
    MOST_COLUMNS = 32766,
    COLUMN_BITS = 16,
    COLUMN_MASK = 0xFFFF,
    /* obstacle numbers have at most 26 bits, so that they fit into `Prediction.obstacle` */
    MOST_OBSTACLES = 67108863,
    /* lists of obstacles at the border of the grid are valid up to this number of cell widths outside the grid */
    OUTWARD = 2,
    EMPTY_LIST = 0, /* `EMPTY_LIST` and `FULL_LIST` are indices in `Grid.lists` */
    FULL_LIST = 1,

    /* number of event times that the event queue compares together; they fill one cache line */
    SIBLINGS = 8,
    /* number of levels of the event queue: enough for 8^10 (about 10^9) discs */
    LEVELS = 11,
    /* largest number of discs that one pass of a search for a disc's next impact processes. Nine cells contain at most
       18 discs, apart from discs in chains */
    BATCH = 64,
    /* number of candidates for which vector instructions compute bounds of the time of impact at once */
    LANES = 4,
    /* largest numbers of discs and of walls for which the loop of few_bodies.h is used; both are multiples of LANES.
       For 16 discs, the loop takes .65 times as long as the event loop; for 25 discs, 1.2 times as long */
    MOST_FEW_DISCS = 16,
    MOST_FEW_WALLS = 8,
};

/* ---- events ---- */

typedef enum Edge {
    NO_EDGE = -1,
    LEFT = 0,
    RIGHT = 1,
    DOWN = 2,
    UP = 3,
    MOTION_END = 4, /* not an edge: the motion of an accelerating disc ends before the disc reaches an edge */
} Edge;

typedef enum EventKind {
    /* the disc has no prediction yet in this epoch (part of the run) */
    START = 0,
    /* the disc leaves its cell */
    CROSSING = 1,
    /* impact with a disc whose path has changed since the impact was predicted */
    STALE = 2,
    /* impact with a disc; only a lower bound of its time is known */
    BOUNDED = 3,
    /* impact with a disc at a known time */
    PAIR_IMPACT = 4,
    /* impact with an obstacle at a known time */
    WALL_IMPACT = 5,
    /* no event to process now: the disc's time in the queue was only a lower bound of the time of its next event */
    POSTPONED = 6,
    MOTION_ENDS = 7,     /* a mode of contact (such as sliding) ends, or the disc stops on a table */
} EventKind;

/* which predictions of a disc must be computed again after an event */
typedef enum Change {
    /* all predictions, because the disc's path has changed */
    OF_PATH = 0,
    /* only the disc's next impact with another disc, whose path has changed */
    OF_PARTNER = 1,
    /* the disc has entered another cell: the time at which it leaves this cell, and impacts with discs in the three
       cells that have become neighbours */
    OF_CELL = 2,
    OF_TIME = 3,      /* no prediction; only the disc's time in the queue must be updated */
} Change;

typedef enum Ending { /* how a call of the event loop ends; solvers/event_driven/run.py uses the same numbers */
    NOT_ENDED = -1,
    /* no impact remains up to the requested time */
    DONE = 0,
    /* an impact remains, but the requested number of impacts is reached */
    LIMIT = 1,
    /* too many impacts occur while time does not advance */
    STANDSTILL = 2,
    /* the requested number of events has been processed */
    PAUSE = 3,
    /* there is not enough memory for recorded impacts or for cells */
    NO_MEMORY = 4,
    /* a disc begins to glide: it moves along an arc in contact, without an impact */
    GLIDES = 5,
    /* two approaching bodies crush a disc before the requested end of the run */
    CRUSHED = 6,
    /* discs have moved outside the grid of cells, so a larger grid may be better */
    OUTGROWN = 7,
    /* a disc rests on a body that does not move. PIC does not solve contacts that cause AT_REST, PRESSED, CORNER or
       EDGE */
    AT_REST = 8,
    PRESSED = 9,      /* two discs stay pressed together */
    CORNER = 10,      /* a disc is wedged between two walls */
    EDGE = 11,        /* a disc reaches the end of a face too slowly to fly off */
} Ending;

typedef struct Event {
    EventKind kind;
    Index disc;
} Event;

/* ---- discs ---- */

typedef struct Disc { /* 64 bytes, one cache line, with all data of a disc that predictions of other discs read */
    double x;         /* centre at `time`, in metres */
    double y;
    double vx; /* velocity */
    double vy;
    /* time at which the disc's present path began: the time of its last impact in this epoch, or 0 if it had none. For
       a disc that never moves, `time` is always 0 */
    double time;
    double radius;
    /* 1 / mass; 0 for a disc that never moves */
    double inverse_mass;
    /* number of impacts so far; a change of this number makes earlier predictions of impacts with this disc stale */
    int impacts;
    int last;            /* the body that the disc hit last: the number of a disc, -1 - k for obstacle k, or NO_BODY */
} Disc;

/* the predicted next impact of a disc with another disc, and the time when it will leave its cell; 32 bytes */
typedef struct Prediction {
    /* time at which the disc hits `partner`; only a lower bound if `exact` is false; INF for never */
    double impact_time;
    /* time at which the disc crosses `edge` of its cell, or hits `obstacle` before that */
    double exit_time;
    /* the disc that this disc hits next, or NOBODY */
    int partner;
    /* value of the partner's `Disc.impacts` when the impact was predicted */
    int partner_impacts;
    /* the disc's cell: row << COLUMN_BITS | column. Row 0 and column 0 are in the ring of empty cells around the
       grid */
    int cell;
    signed int obstacle : 27; /* obstacle hit at `exit_time`; NO_OBSTACLE if the disc crosses an edge then */
    signed int edge : 4;      /* edge crossed at `exit_time`; NO_EDGE if the disc hits an obstacle then */
    unsigned int exact : 1;   /* whether `impact_time` is the exact time and not a bound */
} Prediction;

/* ---- driven bodies ---- */

typedef struct Driven { /* a driven body, or a wall with a moving surface */
    Index body;         /* number of the body: i for disc i, -1 - k for wall k */
    Index first_leg;    /* index in `Driving.legs` of the first leg (part with constant velocity) of its path */
    Index leg_count;    /* number of legs; 0 if only the surface moves */
    Index first_feature; /* for a wall: number of its first feature */
    Index feature_count;
    double x; /* for a disc: centre at the start of the run, in metres */
    double y;
    double belt; /* for a wall: speed of its surface, as in `Surface` */
} Driven;

typedef struct Driving {
    Driven *rows; /* one row per driven body: first walls, then discs, each in ascending order of their numbers */
    Leg *legs;
    Index count;
    Index leg_count;
} Driving;

/* data of a disc that bounces to and fro between two exactly opposite bodies */
typedef struct ToAndFro {
    int last;             /* body that the disc hit last, or NO_BODY */
    int last_obstacle;    /* obstacle of the body `last`; NO_OBSTACLE if that body is a disc */
    int across; /* `across`, `across_obstacle`: like `last` and `last_obstacle`, for the body on the opposite side */
    int across_obstacle;
    double nx; /* unit vector from the last body to the disc */
    double ny;
    Index row; /* number of successive impacts, alternately on one and the other of the two bodies */
} ToAndFro;

typedef struct Crush { /* a disc that two approaching bodies crush */
    Index disc;
    /* two bodies that approach each other, with the disc or a row of touching discs between them */
    Index between[2];
    double time;      /* time at which no space is left between the two bodies */
} Crush;

/* ---- cells ---- */

/* 8 bytes */
typedef struct Cell {
    /* numbers of discs; NOBODY in an empty place. If there are further discs, the last place contains CHAINED - i,
       where i is the first disc of a linked list (chain) of these discs */
    int disc[PLACES];
} Cell;

enum { CHAINED = -2 };

typedef struct Box {
    double left;
    double right;
    double low;
    double high;
} Box;

/* a grid of square cells, surrounded by a ring of cells that stay empty */
typedef struct Grid {
    /* all cells, row by row, including the ring of empty cells */
    Cell *cells;
    /* for each disc, the next disc in its cell's chain (list of further discs), or NOBODY */
    int *chain;
    /* for each tile (block of cells with a common list of obstacles): twice the index in `lists` at which the tile's
       list begins, plus 1 if the tile is at the border of the grid */
    unsigned int *list_of;
    /* the lists of all tiles, one after the other. Each list contains numbers of obstacles in ascending order and ends
       with NO_OBSTACLE */
    int *lists;
    Index listed; /* count of numbers in `lists` */
    Index list_capacity;
    /* memory of cells that were chosen during the run; NULL for the first cells, which are in the arena */
    void *own_memory;
    size_t own_size;
    Box area;  /* box in which the lists of obstacles are valid */
    double x0; /* lower left corner of the first cell inside the ring */
    double y0;
    double width;      /* width of a cell, in metres */
    double radius;     /* radius of the largest disc, in metres */
    double reach;      /* largest sum of the radii of two discs */
    double factor;     /* factor by which the width of a cell is multiplied */
    double extent;     /* upper bound of the absolute coordinates of all obstacles, in metres */
    Index predictions; /* value of `Counts.predictions` when the present cells were chosen */
    Index beyond;      /* value of `Counts.beyond` when the present cells were chosen */
    Index beyond_limit; /* new cells are chosen when `Counts.beyond` has increased by more than this number */
    Index columns;      /* number of columns, without the ring of empty cells */
    Index rows;
    Index stride; /* difference of the indices of a cell and of the cell above it */
    Index tiles;  /* number of tiles (blocks of cells) in a row of tiles */
    int tile_bits; /* a tile is 2^tile_bits cells wide */
} Grid;

typedef struct Block { /* cells that a search for a disc's next impact covers: lines of three cells */
    Index first;
    Index lines;
    Index to_line; /* difference of the indices of two neighbouring lines */
    Index to_cell; /* difference of the indices of two neighbouring cells in a line */
} Block;

/* ---- scan for a disc's next impact ---- */

typedef struct Candidate { /* possible next impact of a disc with `partner` */
    double low;            /* lower and upper bound of the time of impact; equal if the time is exact; INF for never */
    double high;
    Index partner;
} Candidate;

/* candidates in a search for a disc's next impact: entry k of each array belongs to candidate k. The entry after the
   last candidate may be overwritten */
typedef struct Candidates {
    int disc[BATCH + LANES];
    /* centre of the candidate relative to the disc of the search, at the time `start` */
    double dx[BATCH + LANES];
    double dy[BATCH + LANES];
    double ux[BATCH + LANES]; /* velocity of the candidate relative to the disc of the search */
    double uy[BATCH + LANES];
    double reach[BATCH + LANES]; /* sum of the radii */
    double start[BATCH + LANES]; /* the later of the two times at which the paths of the two discs began */
    double start_low[BATCH + LANES]; /* if discs accelerate: low part of `start` */
    double low[BATCH + LANES];   /* bounds of the time of impact, as in `Candidate` */
    double high[BATCH + LANES];
} Candidates;

/* ---- event queue ---- */

/* tournament tree of the times of all discs' next events: level 0 has one time per disc, the top level has the earliest
   time */
typedef struct Queue {
    double *time;
    /* for each time on level 1 or higher: the disc to which the time belongs */
    int *holder;
    Index level[LEVELS]; /* index in `time` and `holder` at which each level begins */
    Index top;
    Index discs;
} Queue;

/* ---- few bodies ---- */

typedef struct FirstImpact { /* the predicted first impact of a disc: see few_bodies.h */
    double time;         /* exact, or a lower bound if `is_exact` is false; INF for never */
    double second;       /* lower bound of the times of the disc's impacts with all other bodies */
    int body;            /* number of a disc, or -1 - k for wall k */
    int partner_impacts; /* if the body is a disc: value of its `Disc.impacts` when the impact was predicted */
    bool is_exact;
} FirstImpact;

/* copies of data of discs and walls, in a run with few bodies. Each field has its own array, because vector
   instructions read the same field of several bodies at once */
typedef struct FewBodies {
    double x[MOST_FEW_DISCS];
    double y[MOST_FEW_DISCS];
    double vx[MOST_FEW_DISCS];
    double vy[MOST_FEW_DISCS];
    double start[MOST_FEW_DISCS]; /* copy of `Disc.time` */
    double radius[MOST_FEW_DISCS];
    double wall_x[MOST_FEW_WALLS];
    double wall_y[MOST_FEW_WALLS];
    double wall_nx[MOST_FEW_WALLS];
    double wall_ny[MOST_FEW_WALLS];
    /* copy of `FirstImpact.time`; INF in an unused place and for a disc that never moves */
    double time[MOST_FEW_DISCS];
    FirstImpact first[MOST_FEW_DISCS];
    Index disc_places; /* number of discs, rounded up to a multiple of LANES */
    Index wall_places;
} FewBodies;

/* ---- the run ---- */

/* An epoch is a part of a run, in which PIC counts time from 0. At t seconds since the start of the present epoch,
   epoch + (epoch_rest + t) seconds have passed since the start of the run */
typedef struct Clock {
    double now;        /* time of the last impact, in seconds since the present epoch */
    double now_low;    /* if discs accelerate: low part of the instant `now`; see arithmetic/double_double.h */
    double epoch;
    double epoch_rest;
    double reported; /* last reported time of an impact, in seconds since the start; the value never decreases */
} Clock;

typedef struct Counts {
    Index impacts; /* number of impacts since the start of the run */
    Index wall_impacts;
    /* number of predictions that impacts have made necessary: one for each movable disc of each impact */
    Index predictions;
    Index stale;
    Index crossings;
    /* number of predictions that checked all features, because the disc leaves the area in which lists of obstacles are
       valid */
    Index beyond;
    Index choices;       /* how often new cells were chosen */
    Index epochs;
    Index epoch_impacts;
    /* number of impacts since the clock last advanced */
    Index at_instant;
    /* number of impacts in the latest epochs (parts of the run), during which no disc has moved */
    Index still_impacts;
    /* if discs accelerate: number of successive ambiguous impacts */
    Index ambiguous_in_row;
    /* if discs accelerate: 1 after contacts at the start of the run have begun, otherwise 0 */
    Index has_begun;
    /* number of discs that have a prediction in this epoch */
    Index predicted;
    /* number of impacts so far from the origin that their normals cannot be computed; if not 0, callers raise an
       error */
    Index too_far;
} Counts;

typedef struct State {
    Disc *discs;
    Prediction *predictions;
    Wall *walls; /* obstacles of a run without features: half-planes with the coefficients of `law` */
    Feature *features;   /* obstacles of a run with features: the features of all walls, wall by wall */
    Law *wall_laws;      /* the law of each wall, if there are features */
    double *last_impact; /* time of each disc's last impact; used only for the TC model (`Law.contact_duration`) */
    Turning *turning;    /* rotation of each disc; NULL if no disc spins and no disc accelerates */
    Index disc_count;
    Index wall_count;
    Index feature_count;
    /* the disc that glides along an arc, if the run ends with `GLIDES` */
    Index gliding;
    /* largest allowed number of impacts at one instant. More impacts end the run with `STANDSTILL` */
    Index standstill;
    /* whether there is gravity or a decelerating table: see `Accelerated` */
    bool has_acceleration;
    /* whether impacts between some bodies have restitution 0: see touched_bodies.h */
    bool has_touched;
    /* whether the run is so large that prefetching saves time: see prefetch.h */
    bool needs_prefetch;
    /* whether `predict_special` must predict events, because there are features or driven bodies */
    bool has_special_paths;
    /* whether the all-pairs loop (all_pairs.h) advances the run */
    bool solves_all_pairs;
    /* whether the loop for few bodies (few_bodies.h) advances the run */
    bool has_few_bodies;
    /* whether `apply_special_impact` must apply impacts, because there are spins, features or driven bodies */
    bool has_special_impacts;
    Clock clock;
    Law law;
    Counts counts;
    Grid grid;
    Queue queue;
    Candidates candidates;
    FewBodies few;
    Record record;
    Box visited; /* box that contains the start positions of discs and their positions at impacts on features */
    Driving driving;
    ToAndFro *to_and_fro; /* data on bouncing to and fro, for each disc; NULL if no body is driven */
    TouchedBodies *touched; /* bodies that each disc touches; NULL if no impact has restitution 0 */
    Accelerated accelerated;
    /* the caller's function that allocates `Grid.lists` and `Grid.own_memory` */
    Resize resize;
    /* how the run ends, if an impact or a contact ends it */
    Ending stopped;
    /* latest end of the run that a caller has requested, in seconds since the start; a later crush does not end the
       run */
    double until;
    Crush crush;    /* the crush that ends the run with `CRUSHED`; its `time` is in seconds since the start */
} State;

/* ---- functions for bindings ---- */

/* Set the sizes of a run. Return the required number of bytes, or 0 if there are too many discs or obstacles. */
size_t carom_set_up(State *s, const RunInput *input);

/* Fill the memory of a run, which must begin at a cache line. Return false if there is not enough memory for the lists
   of obstacles. */
bool carom_begin(State *s, const RunInput *input, void *memory);

/* Apply impacts until one of three limits is reached: the time `until` (in seconds since the start), a total of
   `impacts` impacts in the run, or about `events` events in this call. Impacts exactly at `until` are applied. Return
   the `Ending`, which is never NOT_ENDED or OUTGROWN. */
Ending carom_advance(State *s, double until, Index impacts, Index events);

/* Record all later impacts whose reported times are from `begin` to `end`, in seconds since the start. `recent` must
   have room for one row per disc. */
void carom_record(State *s, Recent *recent, double begin, double end);

/* Prepare to continue an earlier run, after the caller has copied its discs, clock and counts into `s`. All predictions
   are computed again. */
void carom_resume(State *s);

/* Write x, y, vx and vy of each disc at `time`, in seconds since the present epoch. If discs accelerate, `time_low` is
   added to `time`. */
void carom_states(const State *s, double time, double time_low, double *states);

/* Write the spin of each disc at `time` + `time_low`, in seconds since the present epoch. Call this function only if
   discs spin or accelerate. */
void carom_spins(const State *s, double time, double time_low, double *spins);

void carom_impact_counts(const State *s, int64_t *counts);

/* After the ending `GLIDES`, return the wall along which a disc glides. */
Index carom_gliding_wall(const State *s);

/* Return the number of bytes allocated outside of the arena and of the record. */
size_t carom_allocated(const State *s);

/* Free the memory that was allocated outside of the arena and of the record. */
void carom_release(State *s);
