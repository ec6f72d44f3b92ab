/* Structs that both event loops share: bodies, walls, the impact law, recorded impacts.

   Units are metres, seconds, kilograms and radians. A body is a disc (its number, 0 or more) or wall k (-1 - k), as in
   `carom.trace`.

   The core allocates nothing. A caller gives one arena for rows whose number is fixed, and a function `Resize` for
   memory that grows. */

#ifndef CAROM_CORE_H
#define CAROM_CORE_H

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

typedef struct Impact { /* a row of `carom.trace.IMPACT_DTYPE` */
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

typedef struct Spins { /* a row of `carom.trace.SPIN_DTYPE` */
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

typedef struct Recent { /* the earlier impacts of a disc that decide whether its next one is ambiguous: ambiguity.h */
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

#endif
