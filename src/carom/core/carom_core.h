/* The core of Carom: discs and walls in a plane, in C11 without dependencies. Start here.

   `event_driven.c` contains the loop of PIC, which computes the instant of every impact. `frame_sampled.c` contains the
   loop of PIT, which checks for contact once per frame. Both are used by Python (.pyx files) and by the page of
   `carom play` (wasm/). Structs that both loops share follow below; state.h has those of PIC, pit_state.h those of PIT.
   docs/theory/pic.md derives the formulas and explains the algorithms.

   UNITS are metres, seconds, kilograms and radians. A time is counted from the start, from the present epoch or from
   now, as the comment next to it says.

   BODIES are numbered as in `carom.model.trace`: disc i is i, wall k is -1 - k. A wall is a half-plane, a chain of edges and
   arcs, or a circle. Its smallest parts are features: half-planes, faces, vertices, and arcs from outside or inside.
   Where features are the obstacles, obstacle k is -1 - k, too. A body whose motion is prescribed is driven.

   A RUN OF PIC: `carom_set_up` returns the size of the memory, `carom_begin` fills it, `carom_record` sets which
   impacts are recorded. `carom_advance` applies impacts up to a time, a number of impacts or a number of events, and
   returns an `Ending`. It may be called any number of times. Recorded impacts are rows of `Record`; `carom_states` and
   `carom_spins` write the discs at a time, `carom_release` frees what grew. A RUN OF PIT: `carom_pit_set_up`,
   `carom_pit_begin`, `carom_pit_run`, `carom_pit_write_states`.

   EVENTS of PIC, `EventKind` in state.h. Four of them change a prediction only: an edge of a cell is crossed; the
   partner of a predicted impact has moved on; only a bound of an impact's time is known; a disc has no prediction yet.
   Three change a motion: an impact of two discs, an impact with an obstacle, and the end of a mode of contact or of a
   motion on a table. At one instant predictions are settled first. Then motions end, in the order of the discs, and
   then impacts follow in the order of (first, second). `first` is the lower number of two discs, or the disc at a wall,
   so a disc meets walls before discs. `Trace.ambiguous` lists impacts for which this order decides.

   INVARIANTS, which every change must keep:

   - Of two discs the one predicted later has seen the other's path. So the smaller of their two predicted times is
     never later than their impact, and a prediction is stale if the partner's path has changed since.
   - A pair's time depends on the paths of the two alone: it is counted from the later of their own times.
   - Cells, bounds, prefetching, skipped frames and pieces of a run decide when something is computed, never what. The
     all-pairs loop has none of them, and the same bits.
   - A bound covers its own rounding errors. What bounds do not decide is computed exactly. No tolerance is chosen.
   - Floating-point operations are neither reordered nor fused, and only correctly rounded ones are used. Results have
     the same bits on every machine, and in WebAssembly.
   - Nothing is allocated. One arena has the rows whose number is fixed; a function `Resize` supplies memory that grows.
     There is no global state, no input and no output.
   - Instants of discs that accelerate are pairs of floats: instant.h. Straight runs begin a new epoch after 32 impacts
     per disc, so that times stay short: epochs.h.
   - What the law makes 0 is stored as a fact and not computed: the gap and the normal speed of a disc in contact, the
     slip of one that rolls, and bodies that touch after an impact with restitution 0: touched.h.

   FILES. Headers contain inlined functions, one concept each.

   Numbers
     constants.h           constants, each with its unit and reason; macros for compilers
     double_double.h       sums of two floats, longer exact sums, error-free sums and products
     wide_integer.h        whole numbers of 256 bits
     exponentials.h        exp, expm1 and log1p, rounded to the nearest float
     instant.h             instants as pairs of floats
   Times of impact, straight motion
     pair.h                two discs
     feature.h             features of walls, and a disc as seen from a wall
     half_plane.h          the line of a half-plane
     face.h                one side of an edge
     arc.h                 an arc from outside or inside, or a vertex
     feature_time.h        any feature; the gap to it and its normal
   Times of impact, parabolas
     fall.h                any feature, a fixed disc, or a disc with another acceleration
     fall_gap.h            the gap as a polynomial in time
     fall_bounds.h         lower bounds of these times
     quartic.h             instants at which such a polynomial turns negative, in three stages
     quartic_forms.h       a polynomial in floats, in pairs, and as exact products
     quartic_isolation.h   intervals that contain exactly one root, and where to halve first
     quartic_root.h        a root, refined and rounded
   Laws and records, for both loops
     run_input.h           what a run is set up from
     impact.h              restitution and friction of an impact
     contact_law.h         Coulomb's law for a disc pressed to a straight wall
     damping.h             linear damping as a change of time
     resolution.h          what rounding makes uncertain about an impact's time
     touched.h             bodies that a disc touches without speed along the normal
     record.h              rows of recorded impacts, and which depend on an order that physics does not decide
     arena.h               rows whose number is fixed
   The event-driven loop (PIC)
     state.h               state of a run, kinds of events, functions for bindings: read it first
     accelerated.h         structs of discs that accelerate
     event_driven.c        the loop and the set-up
     events.h              the next event of a disc, and of all
     queue.h               tournament tree of the times of next events
     grid.h                cells
     obstacles.h           lists of obstacles near each cell, and how a disc's stay there ends
     scan.h                which disc a disc meets next
     motion.h              straight paths: positions, and times on them
     impacts.h             an impact is applied and recorded
     touching.h            touched.h in a run
     epochs.h              time is counted anew from the present
     prefetch.h            memory that the next event needs is loaded
     memory.h              the arena of a run
     driven.h              impacts with driven bodies; runs with features or spins
     prescribed.h          where a driven body is
     crush.h               discs that go to and fro between closing bodies
     crush_rule.h          whether such a disc is crushed, and when
     crush_rule_bodies.h   bodies as that rule sees them
     crush_rule_row.h      the same for a row of discs
     parabola.h            paths of discs that accelerate: positions, and times on them
     parabola_exit.h       the end of a stay in a cell, for parabolas
     parabola_scan.h       scan.h for parabolas
     parabola_impacts.h    impacts.h for parabolas; where contact begins, ends, or ends the run
     contact.h             discs in contact with a wall: modes, when they change, and their record
     two_discs.h           two discs without walls: a closed form
     all_pairs.h           the all-pairs loop, the oracle of the event loop
   The frame-sampled loop (PIT)
     pit_state.h           state of a run, and functions for bindings: read it first
     frame_sampled.c       the loop
     pit_set_up.h          the rows of a run
     pit_tests.h           one frame
     pit_pending.h         its pending tests, in the order of Algorithm 1
     pit_impacts.h         an interference test, and an impact
     pit_separation.h      bodies that a disc cannot approach on its present path
     pit_motion.h          motion between frames
     pit_driven.h          driven bodies at a frame
     pit_search.h          which tests a disc needs now, and when it is due again
     pit_bounds.h          how long a disc can meet nothing
     pit_grid.h            cells, for discs of any sizes
     pit_sweep.h           all tests of a frame at once, where skipping does not pay
     pit_work.h            whether skipping pays
     chain_distance.h      the point of a chain nearest to a disc
   Bindings for Python: a .pyx file is a module, a .pyi file has its types, a .pxd file has declarations
     pic.pyx, .pxd, .pyi   runs of PIC
     pit.pyx, .pyi         runs of PIT
     primitives.pyx, .pyi  single formulas
     damped_time.pyx, .pyi damping
     built.pyx, .pyi       the sources that the extension was built from
     carom_core.pxd        declarations of this file
     formulas.pxd          declarations of formulas
     run_input.pxd         declarations of run_input.h, and its arrays from those of Python
     record_rows.pxd       recorded impacts as arrays
     exact_quartic.pxd     the third stage of quartics: exact integers, in Python
     binding_memory.h      `Resize` for Python
   The page, compiled to carom/web/core.wasm by `make generated`
     wasm/input.h          input and output of a run as arrays
     wasm/memory.c         memory, and what a C library would supply
     wasm/pic.c            runs of PIC
     wasm/pit.c            runs of PIT
     wasm/include          headers of the C library, as far as they are used */

#pragma once

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

typedef ptrdiff_t Index;

enum {
    NOBODY = -1,     /* no disc: an empty place, no partner */
    NO_FEATURE = -1, /* no feature of a wall, or none that matters */
};

/* Enlarge memory to `size` bytes, of which the first `used` are kept; NULL, with the old memory intact, if there is no
   more. `memory` is NULL at first. Size 0 releases the memory and returns NULL. */
typedef void *(*Resize)(void *memory, size_t used, size_t size);

/* ---- bodies ---- */

typedef struct Wall { /* the free side is (p - q).n >= 0 */
    double x;         /* q, a point of the surface */
    double y;
    double nx; /* n, unit normal into the free side */
    double ny;
} Wall;

typedef struct Surface { /* of a driven or conveyor wall, or of a driven disc */
    double vx;           /* velocity of the wall */
    double vy;
    double belt; /* speed of its surface to the left of the normal, metres a second */
} Surface;

typedef struct Turning { /* of a disc, in a scene with spin; apart from a solver's own row of it */
    double spin;         /* radians a second, counterclockwise */
    double inverse_inertia_ratio; /* 1/k, mass times radius squared over the moment of inertia; 0: it never turns */
} Turning;

/* ---- the impact law ---- */

typedef struct ContactFriction { /* of two bodies in contact */
    double friction;             /* Coulomb's coefficient f, 0 or more */
    double restitution; /* b, -1 to 1: the reversed slip after an impact in which they stick, over that before */
} ContactFriction;

typedef struct Law {
    double restitution; /* of two discs */
    double wall_restitution;
    double contact_duration; /* of the TC model, seconds: an impact so soon after a disc's last loses no energy; or 0 */
    ContactFriction contact; /* of two discs */
    ContactFriction wall_contact;
} Law;

typedef struct Body {    /* a disc as the law sees it */
    double *velocity;    /* x, y */
    double inverse_mass; /* 0: it never moves */
    double radius;
    Turning *turning; /* read only in a scene with spin */
} Body;

/* ---- recorded impacts ---- */

typedef struct Impact { /* a row of `carom.model.trace.IMPACT_DTYPE` */
    double time;        /* since the start */
    int64_t first;      /* disc */
    int64_t second;     /* body */
    double normal[2];   /* unit vector from first to second */
    double first_before[2]; /* velocities */
    double second_before[2];
    double first_after[2];
    double second_after[2];
} Impact;

typedef struct Before { /* velocities before an impact; that of a wall at rest is 0 */
    double first[2];
    double second[2];
} Before;

typedef struct Spins { /* a row of `carom.model.trace.SPIN_DTYPE` */
    double first_before;
    double second_before;
    double first_after;
    double second_after;
} Spins;

typedef struct Contact { /* place of an impact, with finite walls; a row of `carom.solvers.rows.CONTACT_DTYPE` */
    double x;            /* centre of the first disc */
    double y;
    int64_t feature; /* its number, or NO_FEATURE for another disc */
} Contact;

typedef struct LastContact { /* an impact as the next one of the same disc sees it */
    double latest;           /* upper bound of its time since the start; -INF for none */
    double nx;
    double ny;
    int feature;  /* of a finite wall without friction; NO_FEATURE for anything else */
    bool elastic; /* whether that wall loses no energy */
} LastContact;

typedef struct Recent { /* the earlier impacts of a disc that decide whether its next one is ambiguous: record.h */
    LastContact furthest;
    LastContact across;
} Recent;

/* Whether a disc that meets two features at one instant goes on in the same way in either order. */
typedef bool (*IsOrderFree)(void *context, int one, int other, bool elastic);

typedef struct Corners {
    IsOrderFree is_order_free; /* called for numbers of features only */
    void *context;
} Corners;

typedef struct Record {
    Impact *rows;
    Spins *spins;       /* one a row, in a scene with spin */
    Contact *contacts;  /* one a row, in a scene with finite walls */
    bool has_spins;
    bool has_contacts;
    Corners corners;
    Resize resize; /* of rows, spins, contacts and ambiguous; the caller frees them */
    Index count;
    Index capacity;
    int64_t *ambiguous; /* numbers of ambiguous rows, from the first one of the run on */
    Index ambiguous_count;
    Index ambiguous_capacity;
    Index released; /* rows that were moved to the caller before those in `rows` */
    Recent *recent; /* one a disc */
    bool is_wanted;
    double begin; /* impacts from this time to the other are recorded, since the start */
    double end;
} Record;
