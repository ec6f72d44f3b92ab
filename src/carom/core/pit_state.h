/* State of the frame-sampled loop (PIT): to be read before its other headers.

   Units are metres, metres a second and kilograms; times are seconds since the start. Walls, spins, the impact law and
   recorded impacts are those of carom_core.h. */

#ifndef CAROM_PIT_STATE_H
#define CAROM_PIT_STATE_H

#include "carom/core/arena.h"
#include "carom/core/carom_core.h"
#include "carom/core/chain_distance.h"

enum {
    NO_CELL = -1,
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

typedef struct Normal { /* of the finite wall that a disc met last */
    double x;
    double y;
} Normal;

/* ---- cells ---- */

typedef struct Level { /* square cells for discs of about one size */
    double width;      /* of a cell */
    double leeway;     /* how far a disc may be from where it was when it was put into its cell */
    double reach;      /* the largest radius on this level, and the leeway */
} Level;

typedef struct Grid {
    int *first;       /* of each list: a disc, or NOBODY. The cells of an unbounded plane share these lists. */
    Index list_count; /* a power of 2; 0 for so few discs that all count as near each other */
    Index level_count;
    Level levels[MAX_LEVELS];
} Grid;

/* ---- the tests of one frame ---- */

typedef uint64_t Test; /* a pair's or a wall's place in the order of Algorithm 1: pit_pending.h */

typedef struct Pending { /* tests still to be made at this frame: a binary heap, the next one on top */
    Test *heap;
    Index count;
    Index capacity;
    Test last; /* the last one made at this frame, or NO_TEST */
} Pending;

/* ---- the run ---- */

typedef struct Clock { /* frame k is at k * step / rate, and one of the two is 1: neither form adds a rounding */
    double step;       /* seconds */
    double rate;       /* frames a second */
} Clock;

typedef struct Counts {
    Index frames; /* passed: those before this number */
    Index tested; /* frames at which anything was tested */
    Index pair_tests;
} Counts;

typedef struct State {
    Disc *discs;
    Wall *walls;      /* of a finite one, its normal where a disc has just met it */
    Law *wall_laws;   /* the law of each wall */
    Chain *chains;    /* one a wall; NULL if all walls are half-planes */
    ChainEdge *edges; /* of all chains */
    Normal *normals;  /* one a disc, with finite walls */
    Turning *turning; /* of each disc; NULL if no disc spins */
    double *due;      /* before this time no impact of a disc can be due; INF for one that never moves */
    int *due_discs;   /* discs that are due at this frame */
    Index disc_count;
    Index wall_count;
    Index edge_count; /* of all chains */
    bool has_chains;
    double now;      /* time of the frame that was passed last */
    double next_due; /* no disc is due before */
    double horizon;  /* how long a bound holds at most, seconds: `MAX_BOUND_FRAMES` of pit_bounds.h */
    bool falls;      /* whether there is gravity */
    double gx;       /* gravity */
    double gy;
    bool skips;          /* whether tests that can find nothing are skipped; the bounds for it are of straight paths */
    Index row;           /* plain looping: the disc whose tests come next at this frame; 0 between frames */
    double excess;       /* work of skipping beyond that of plain looping */
    double first_search; /* work of scheduling all discs once */
    double max_waste;    /* how many times that much may be in excess */
    bool pays_back;      /* whether it loops plainly, since there was more */
    double work;         /* left until a pause; all work is counted in tests of two discs by plain looping */
    bool is_out_of_memory;
    bool is_too_far; /* whether discs met so far out that floats do not resolve the distance of their centres */
    Law law;
    Clock clock;
    Counts counts;
    Grid grid;
    Pending pending;
    Record record;
    double steps[MAX_STEPS]; /* lengths of the steps to the next frames */
} State;

/* ---- what bindings call, in this order ---- */

/* Place all rows of a run in memory, and return its size in bytes; with NULL only return the size. Counts, `has_chains`,
   `record.has_spins` and `skips` are set. */
size_t carom_pit_lay_out(State *s, char *memory);

/* Begin a run whose discs, walls, chains, spins and laws have been written. */
void carom_pit_begin(State *s);

/* Pass the frames before number `until`, until work or memory is used up, or until there have been `most` impacts. */
void carom_pit_run(State *s, Index until, Index most);

/* Write x, y, vx, vy of each disc at a time not before the last frame. */
void carom_pit_write_states(const State *s, double time, double *states);

#endif
