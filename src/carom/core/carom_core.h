/* The core of Carom: discs and walls in a plane, in C11 without dependencies. Read this header first.

   The core has two solvers. PIC (`event_loop.c`) computes the exact instant of every impact and goes from one impact to
   the next. PIT (`frame_loop.c`) advances all discs frame by frame and checks for contact once per frame, as most
   physics engines do. Python calls both solvers through the .pyx files, and the page of `carom play` calls them through
   wasm/. This header defines the structs that both solvers share. pic/state.h defines the structs of PIC, and
   pit/state.h those of PIT. docs/theory/pic.md derives the formulas and explains the algorithms.

   UNITS are metres, seconds, kilograms and radians. Each time is counted from the start of the run, from the start of
   the current epoch, or from now: see the comment of its field. An epoch is a part of a run at whose start PIC counts
   time from 0 again (clock.h).

   BODIES are numbered as in `carom.model.trace`: disc i has the number i, and wall k the number -1 - k. A wall is a
   half-plane, a circle, or a chain of edges and arcs. The parts of a wall that a disc can hit are its features:
   half-planes, faces (sides of straight edges), vertices, and the outside or inside of arcs. An obstacle is a wall or
   feature that PIC tests discs against: in simple scenes a whole wall, and in other scenes a feature (see pic/state.h).
   Obstacle k also has the number -1 - k. Impacts do not change the path of a driven body. The ground of a disc is the
   half-plane or face on which it slides, rolls or rests.

   A RUN OF PIC calls these functions:

   - `carom_set_up` returns the size of the memory that the run needs, and `carom_begin` fills that memory.
   - `carom_record` chooses which impacts are recorded. Recorded impacts become rows of `Record`.
   - `carom_advance` applies impacts until a given time, a given number of impacts or a given number of events is
     reached, and returns an `Ending`. `carom_advance` may be called any number of times.
   - `carom_states` and `carom_spins` write the state of all discs at a time.
   - `carom_release` frees the memory that grew during the run.

   A RUN OF PIT calls `carom_pit_set_up`, `carom_pit_begin`, `carom_pit_run` and `carom_pit_write_states`.

   EVENTS of PIC (`EventKind` in pic/state.h) are of two sorts. Events of the first sort change predictions only.
   Examples are a disc that crosses an edge of its cell, and a disc whose predicted partner has changed its path. An
   event of the second sort changes a motion: two discs collide, a disc hits an obstacle, or a disc stops sliding,
   rolling, resting or moving on a table.

   Several events may have the same instant. Events that change only predictions are then processed first. Ends of
   motions come second, in the order of the discs' numbers. Impacts are last, in ascending order of the numbers (first,
   second) of their two bodies. For two discs, `first` is the lower number. For a disc and a wall, `first` is the disc.
   For the same `first`, walls come before discs, because the numbers of walls are negative. `Trace.ambiguous` lists the
   impacts whose result depends on the order of simultaneous events.

   INVARIANTS, which every change must keep:

   - Each disc has a prediction. For any two discs A and B, the later of the two predictions was made from the current
     paths of both discs. The smaller of the times predicted for A and for B is therefore never later than the impact of
     A on B. A prediction is stale if the partner's path has changed since the prediction was made.
   - The computed time of impact of two discs depends only on their two paths, and not on when it is computed. To
     compute this time, both discs are first moved to the later of the two times at which their paths began.
   - Cells, bounds, prefetching, skipped frames and pauses decide when something is computed, and never change a result.
   - A bound includes its own rounding errors. A comparison that bounds do not decide is decided exactly. There are no
     tolerances.
   - Floating-point operations are neither reordered nor fused, and only correctly rounded operations are used. Results
     are therefore bit-identical on every machine and in WebAssembly.
   - The core does not call an allocator. Arrays of fixed length are in one block of memory, the arena. The caller's
     function `Resize` supplies memory for arrays that grow. There is no global state, no input and no output.
   - For discs that accelerate, an instant is the sum of two floats, its high and its low part
     (arithmetic/double_double.h). Runs without acceleration begin a new epoch after 32 impacts per disc. Times then
     stay small, so their floats stay precise (clock.h).
   - Quantities that the physical law makes 0 are set to 0 and not computed. Examples are the gap and the normal
     speed of a disc in contact, the slip of a rolling disc, and the normal speed of two bodies that touch after an
     impact with restitution 0 (pic/touched_bodies.h).

   FILES. Each header contains the inlined functions of one concept. A header includes the headers of the concepts that
   it uses.

   Shared by both solvers
     constants.h                  constants, each with its unit and reason; macros for compilers
     run_input.h                  the input of a run
     feature.h                    features of walls, and a disc relative to a wall
     impact_law.h                 restitution and friction in an impact
     wall_contact_law.h           Coulomb's law for a disc that is pressed against a straight wall
     damping.h                    linear damping as a substitution of the time
     impact_record.h              recorded impacts: resolution of their times, ambiguity, rows
   arithmetic/: numbers that one float cannot represent
     arithmetic/double_double.h   pairs: numbers as sums of two floats; error-free sums and products; instants
     arithmetic/exponentials.h    exp, expm1 and log1p, rounded to the nearest float
     arithmetic/wide_integer.h    integers of 256 bits, for exponentials that are hard to round
   straight/: times of impact in straight motion
     straight/pair_time.h         two discs
     straight/line_time.h         a disc and the line of a half-plane, or a face
     straight/feature_time.h      a disc and an arc, a vertex or any feature; the gap to a feature, and the normal
   parabola/ and quartic/: times of impact on parabolas
     parabola/fall_time.h         times of impact on any feature, a fixed disc, or a disc with another acceleration
     parabola/fall_bounds.h       lower bounds of these times
     parabola/gap_polynomial.h    the gap as a polynomial in time
     quartic/falls.h              instants at which such a polynomial becomes negative, in three stages
     quartic/polynomial.h         a polynomial in floats, in pairs, and as exact products
     quartic/root_isolation.h     intervals that contain exactly one root
     quartic/root_refinement.h    refinement and rounding of a root
   pic/: the event-driven solver
     pic/state.h                  state of a run, kinds of events, functions for bindings; read it first
     pic/accelerated_state.h      structs for discs that accelerate
     pic/event_loop.c             the event loop, and the functions for bindings
     pic/set_up.h                 memory of a run, filled from its input
     pic/clock.h                  reported times; epochs, in which time is counted from 0 again
     pic/next_event.h             the next event of a disc, and of all discs
     pic/event_queue.h            tournament tree of the times of next events
     pic/grid.h                   cells
     pic/obstacle_lists.h         lists of obstacles near each cell
     pic/separation.h             bodies that a disc does not approach on its present path
     pic/touched_bodies.h         bodies that a disc touches without normal speed
     pic/prefetch.h               loads memory for the next event
     pic/all_pairs.h              the all-pairs loop, which tests compare with the event loop
     pic/few_bodies.h             the loop for few discs and walls, which uses no cells
     pic/two_discs.h              two discs without walls: a closed form
     Straight motion and parabolas have a file for each of four questions:
     pic/straight_motion.h        where a disc is, and when it reaches another body
     pic/parabola_motion.h
     pic/straight_partner.h       with which disc it collides next
     pic/parabola_partner.h
     pic/straight_exit.h          when it leaves its cell, or hits an obstacle before that
     pic/parabola_exit.h
     pic/straight_impact.h        what an impact changes
     pic/parabola_impact.h        impacts of discs that accelerate, and contacts that begin at an impact
     pic/motion_changes.h         contacts at the start of a run, and the end of a motion without an impact
     pic/lasting_contact.h        discs in contact with a wall: modes, and when they change
     pic/driven_path.h            positions of driven bodies
     pic/driven_impact.h          impacts with driven bodies; runs with features or spins
     pic/crush.h                  discs between two approaching bodies, and when they are crushed
     pic/crush_bodies.h           functions on bodies for the rule of crush.h
     pic/crushed_row.h            the rule of crush.h for a row of discs
   pit/: the frame-sampled solver
     pit/state.h                  state of a run, functions for bindings; read it first
     pit/frame_loop.c             the frame loop, and the functions for bindings
     pit/set_up.h                 memory of a run, filled from its input
     pit/frame.h                  one frame: all its tests, or only those that can find an impact
     pit/pending_tests.h          remaining tests of a frame, in the order of Algorithm 1
     pit/motion.h                 motion between frames; driven bodies
     pit/interference_test.h      interference tests and impacts
     pit/separation.h             bodies that a disc cannot approach on its present path
     pit/contact.h                contacts after restitution 0, and approaches that are only rounding errors
     pit/schedule.h               which tests a disc needs at a frame, and when it needs the next tests
     pit/skip_bounds.h            lower bounds of the time until a disc can hit another body
     pit/grid.h                   cells for discs of any sizes
     pit/sweep.h                  all tests of a frame at once, if scheduling costs too much
     pit/chain_distance.h         the point of a chain nearest to a disc
   Bindings for Python: a .pyx file is a module, a .pyi file has its types, a .pxd file has declarations
     pic.pyx, .pxd, .pyi          runs of PIC
     pit.pyx, .pyi                runs of PIT
     primitives.pyx, .pyi         single formulas
     damped_time.pyx, .pyi        damping
     built.pyx, .pyi              a digest of the sources from which the extension was built
     carom_core.pxd               declarations of this file
     formulas.pxd                 declarations of formulas
     run_input.pxd                declarations of run_input.h; conversion of Python arrays
     record_rows.pxd              recorded impacts as arrays
     exact_quartic.pxd            the third stage of quartic/falls.h: exact integers, in Python
     binding_memory.h             `Resize` for Python
   wasm/: the interface for the page of `carom play`; `make generated` compiles it with the core to carom/web/core.wasm
     wasm/input.h                 input and output of a run as arrays
     wasm/memory.c                memory, and replacements for the C library
     wasm/pic.c                   runs of PIC
     wasm/pit.c                   runs of PIT
     wasm/include/math.h          the functions of math.h that the core uses
     wasm/include/string.h        the functions of string.h that the core uses */

#pragma once

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

typedef ptrdiff_t Index;

enum {
    NOBODY = -1,     /* an empty place, or no partner */
    NO_FEATURE = -1, /* used as a feature's number if there is no feature, or if the number does not matter */
};

/* ---- memory ---- */

/* Resize a block of memory to `size` bytes and keep its first `used` bytes. If there is not enough memory, return NULL
   and leave the old block unchanged. If `memory` is NULL, allocate a new block. If `size` is 0, free the block and
   return NULL. */
typedef void *(*Resize)(void *memory, size_t used, size_t size);

typedef struct Arena { /* one block of memory for all arrays of fixed length */
    /* start of the block; NULL while the size of the block is computed. A `lay_out` function runs twice: first to
       compute the size of the block, and then to assign the addresses of the arrays */
    char *memory;
    size_t used; /* number of bytes reserved so far */
} Arena;

/* Reserve `size` bytes for rows. Return the address of the first byte, which is the start of a cache line. */
static inline void *reserve_bytes(Arena *arena, size_t size) {
    void *begin = arena->memory == NULL ? NULL : arena->memory + arena->used;
    arena->used += (size + 63) / 64 * 64;
    return begin;
}

/* Reserve memory in an arena for `count` rows of type `type`. */
#define RESERVE_ROWS(arena, type, count) ((type *)reserve_bytes((arena), (size_t)(count) * sizeof(type)))

/* ---- bodies ---- */

typedef struct Wall { /* a half-plane: the points p on its free side have (p - q).n >= 0 */
    double x;         /* q, a point of the surface, in metres */
    double y;
    double nx; /* n, unit normal that points to the free side */
    double ny;
} Wall;

typedef struct Surface { /* motion of a driven wall, a driven disc, or a conveyor wall */
    double vx;           /* velocity of the body, in m/s */
    double vy;
    /* speed at which a conveyor's surface moves relative to its wall, in m/s; positive to the left of the normal */
    double belt;
} Surface;

typedef struct Point {
    double x;
    double y;
} Point;

typedef struct Leg { /* part of a driven body's path with constant velocity */
    double begin;    /* start of the leg, in seconds since the current epoch began */
    double end;      /* end of the leg, in seconds since the current epoch began; INF for the last leg */
    double begins;   /* start of the leg, in seconds since the start of the run; `ends` is its end */
    double ends;
    double moved_x; /* displacement of the body from its start position at the start of the leg, in metres */
    double moved_y;
    double vx;
    double vy;
} Leg;

/* Return the displacement of a driven body from its start position, at a time within the given leg. */
static inline Point displacement_on(const Leg *leg, double time) {
    double lasted = time - leg->begin;
    return (Point){leg->moved_x + leg->vx * lasted, leg->moved_y + leg->vy * lasted};
}

typedef struct Turning { /* rotation of a disc, in a scene with spin */
    double spin;         /* spin of the disc, in rad/s, counterclockwise */
    /* 1/k, where k is the moment of inertia divided by mass times radius squared; 0 if the disc never turns */
    double inverse_inertia_ratio;
} Turning;

/* ---- the impact law ---- */

typedef struct ContactFriction { /* friction between two bodies in contact */
    double friction;             /* Coulomb's coefficient f, 0 or more */
    /* tangential restitution b, -1 to 1: if friction is strong enough to stop the sliding, the slip (sliding speed)
       after the impact is -b times the slip before */
    double restitution;
} ContactFriction;

typedef struct Law {
    double restitution; /* coefficient of restitution between two discs */
    double wall_restitution;
    /* contact duration of the TC (time of contact) model, in seconds; 0 if the model is not used. If an impact follows
       the disc's previous impact within this duration, no energy is lost */
    double contact_duration;
    ContactFriction contact; /* friction between two discs */
    ContactFriction wall_contact;
} Law;

typedef struct Body {    /* data of a disc for the impact law */
    double *velocity;    /* x and y */
    double inverse_mass; /* 1 / mass; 0 for a disc that never moves */
    double radius;
    Turning *turning; /* rotation of the disc; used only in a scene with spin */
} Body;

/* ---- recorded impacts ---- */

typedef struct Impact { /* a recorded impact, a row of `carom.model.trace.IMPACT_DTYPE` */
    double time;        /* time of the impact, in seconds since the start of the run */
    int64_t first;      /* disc */
    int64_t second;     /* body */
    double normal[2];   /* unit vector from the first body to the second */
    double first_before[2]; /* velocities of both bodies before and after the impact, in m/s */
    double second_before[2];
    double first_after[2];
    double second_after[2];
} Impact;

static inline void write_velocity(double *velocity, double vx, double vy) {
    velocity[0] = vx;
    velocity[1] = vy;
}

typedef struct Spins { /* spins of both bodies at an impact, a row of `carom.model.trace.SPIN_DTYPE` */
    double first_before;
    double second_before;
    double first_after;
    double second_after;
} Spins;

/* position of an impact, recorded in scenes with finite walls; a row of `carom.solvers.rows.CONTACT_DTYPE` */
typedef struct Contact {
    double x;            /* centre of the first disc, in metres; a driven wall's displacement is subtracted */
    double y;
    int64_t feature; /* number of the feature, or NO_FEATURE if the second body is a disc */
} Contact;

typedef struct LastContact { /* data of a disc's impact, which are compared with the disc's later impacts */
    /* upper bound of the impact's time, in seconds since the start; -INF if there was no impact */
    double latest;
    double nx;
    double ny;
    /* number of the hit feature if it belongs to a finite wall and friction does not act, else NO_FEATURE */
    int feature;
    bool elastic; /* whether impacts on this wall lose no energy */
} LastContact;

/* the two earlier impacts of a disc that decide whether its next impact is ambiguous; see impact_record.h */
typedef struct Recent {
    LastContact furthest;
    LastContact across;
} Recent;

/* Return whether two impacts of a disc on two features at the same instant have the same result in both orders. */
typedef bool (*IsOrderFree)(void *context, int one, int other, bool elastic);

typedef struct Corners {
    IsOrderFree is_order_free; /* a function, called with the numbers of two features */
    void *context;
} Corners;

typedef struct Record {
    Impact *rows;
    Spins *spins;       /* spins of the bodies of each impact in `rows`, in a scene with spin */
    Contact *contacts;  /* position of each impact in `rows`, in a scene with finite walls */
    bool has_spins;
    bool has_contacts;
    Corners corners;
    Resize resize; /* resizes the arrays `rows`, `spins`, `contacts` and `ambiguous`, which the caller frees */
    Index count;
    Index capacity;
    int64_t *ambiguous; /* numbers of the ambiguous impacts, counted from the run's first recorded impact */
    Index ambiguous_count;
    Index ambiguous_capacity;
    Index released; /* number of recorded impacts that the caller has already removed from `rows` */
    Recent *recent; /* one `Recent` per disc */
    bool is_wanted;
    double begin; /* only impacts from `begin` to `end` are recorded, in seconds since the start */
    double end;
} Record;
