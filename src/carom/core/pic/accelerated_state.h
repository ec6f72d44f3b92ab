/* Structs for discs that accelerate: in free fall, in contact with a wall, or on a decelerating table.

   Between two events such a disc has a constant acceleration, so its path is a parabola. Units are those of
   pic/state.h. */

#pragma once

#include "carom/core/carom_core.h"
#include "carom/core/parabola/fall_time.h"

typedef enum Mode { /* kind of motion of a disc; `carom.model.trace.Mode` has the same numbers */
    FLIGHT = 0,
    SLIDE = 1,
    ROLL = 2,
    REST = 3,
    BLOCK = 4, /* slides without turning */
} Mode;

typedef enum NeverMet { /* which features of a wall a disc never hits on its present path, regardless of rounding */
    NEVER_NOTHING = 0,
    NEVER_ALL = 1,  /* all features in the list of the ground that the disc is in contact with */
    /* after the disc has left the ground over a vertex: the faces and vertices of that list, except this vertex */
    NEVER_FLAT = 2,
} NeverMet;

typedef struct Parabola { /* path of a disc: data that its row `Disc` does not contain */
    double ax;            /* acceleration */
    double ay;
    double time_low;   /* low part of the disc's own instant; the high part is `Disc.time` */
    double impact_low; /* low parts of the two times of its `Prediction` */
    double exit_low;
    double leaving;   /* normal speed after its last impact */
    double spin_rate; /* radians per second squared */
    double entered;   /* when it entered its present cell */
    Instant left;     /* of its last impact in contact; the gap to `left_ground` since then follows from `left_speed` */
    double left_speed; /* speed at which that gap opened */
    double corner_way; /* signed distance along `corner_ground` from the point where the disc also touches `corner` */
    Instant ends;     /* when this motion ends by itself: a mode of contact ends, or the disc stops on a table */
    int ground;       /* feature that it is in contact with, or NO_OBSTACLE */
    int never_of;     /* feature whose list `never_met` refers to */
    int never_but;    /* vertex that is an exception to NEVER_FLAT */
    /* for a disc that bounces between two walls: the ground from which an impact on the other wall lifted it; otherwise
       NO_OBSTACLE */
    int left_ground;
    /* convex body at rest that the disc hit last while it was on `corner_ground`, as in `Disc.last`; NO_BODY if there
       is none, or if the disc has since hit anything except `corner_ground` */
    int corner;
    int corner_ground;
    int changes;      /* number of changes of its motion without an impact; Disc.impacts includes them */
    unsigned char mode;      /* Mode */
    unsigned char never_met; /* NeverMet */
    bool ends_at_face_end;   /* whether the contact ends at the end of the face */
    bool slip_ends;          /* whether the slip is 0 at `ends` */
    bool rim_ends;           /* whether the spin is 0 at `ends` */
    bool sticks;             /* whether friction has stopped all slip in its last bounce */
    bool rubs;               /* whether there was an impulse of friction in its last bounce */
} Parabola;

typedef struct Ground { /* data of a half-plane or face for a disc in contact with it */
    double x;           /* a point of the surface; for a face, its start */
    double y;
    int over[2];     /* vertex at each end of a face; NO_OBSTACLE if the wall continues smoothly there */
    int never_first; /* index in `Accelerated.never_lists` of the first feature that a disc on this ground never hits */
    int never_count;
    bool is_ground; /* whether lasting contact is solved here: false for driven walls and curved features */
} Ground;

typedef struct ModeRow { /* a row of `carom.model.trace.MODE_DTYPE` */
    double time;         /* since the start */
    int64_t impacts;     /* number of impacts recorded before this change */
    int64_t disc;
    int64_t wall; /* body */
    int64_t before;
    int64_t after;
    double position[2];
    double velocity[2];
    double acceleration[2];
    double spin;
    double spin_rate;
} ModeRow;

typedef struct ContactEnd { /* a contact that is not solved and has therefore ended the run */
    Index disc;
    Index other;        /* the other body */
    int obstacle;       /* obstacle of that body; NO_OBSTACLE for a disc */
    int held_by;        /* feature that the disc was already in contact with, or NO_OBSTACLE */
    bool after_bounces; /* whether infinitely many bounces came before */
} ContactEnd;

typedef struct Accelerated {
    Parabola *paths; /* one per disc; NULL if all discs move straight */
    Ground *grounds; /* one per feature */
    int *never_lists;
    Index never_length;
    double gx; /* gravity */
    double gy;
    double deceleration;       /* deceleration by a table, opposite to each disc's motion; 0 without a table */
    double rolling_resistance; /* of discs on walls */
    ExactQuartic exact;
    ModeRow *modes; /* recorded changes of mode */
    Index mode_count;
    Index mode_capacity;
    ContactEnd end;
} Accelerated;
