/* Structs for discs that accelerate: in free fall, in contact with a wall, or on a decelerating table.

   Between two events such a disc has a constant acceleration, so its path is a parabola. Units are those of
   pic/state.h. */

#pragma once

#include "carom/core/carom_core.h"
#include "carom/core/parabola/fall_time.h"

typedef enum Mode { /* kind of motion of a disc; `carom.model.trace.Mode` uses the same numbers */
    FLIGHT = 0,
    SLIDE = 1,
    ROLL = 2,
    REST = 3,
    BLOCK = 4, /* the disc slides without turning, because rolling resistance stops its rotation */
} Mode;

typedef enum NeverMet { /* which features of a wall a disc never hits on its present path, regardless of rounding */
    NEVER_NOTHING = 0,
    /* the features in the list of `Parabola.never_of`, which is the ground that the disc is in contact with */
    NEVER_ALL = 1,
    /* the disc has left the ground at a vertex; it never hits the faces and vertices in the list of
       `Parabola.never_of`, except this vertex */
    NEVER_FLAT = 2,
} NeverMet;

typedef struct Parabola { /* path of a disc: data that its row `Disc` does not contain */
    double ax;            /* acceleration, in metres per second squared */
    double ay;
    double time_low;   /* low part of the instant at which the path began; the high part is `Disc.time` */
    /* `impact_low` and `exit_low`: low parts of `impact_time` and `exit_time` in the disc's `Prediction` */
    double impact_low;
    double exit_low;
    double leaving;   /* speed along the normal just after its last impact, in metres per second */
    double spin_rate; /* rate of change of the spin, in radians per second squared */
    double entered;   /* time at which the disc entered its present cell */
    /* instant of the last impact of the disc while it was in contact with a ground. The gap to `left_ground` is
       computed from the time since then and from `left_speed` */
    Instant left;
    double left_speed; /* speed at which the gap to `left_ground` opened at the instant `left` */
    /* signed distance of the disc, along `corner_ground`, from the point at which it also touches `corner` */
    double corner_way;
    /* instant at which this motion ends without an impact: a mode of contact ends, or the disc stops on a table */
    Instant ends;
    int ground;       /* feature that the disc is in contact with, or NO_OBSTACLE */
    int never_of;     /* feature whose list `never_met` refers to */
    int never_but;    /* with NEVER_FLAT: the vertex that the disc can hit */
    /* for a disc that was in contact with a ground until an impact on another body lifted it: that ground; otherwise
       NO_OBSTACLE */
    int left_ground;
    /* convex body at rest that the disc hit last while it was on `corner_ground`, numbered as in `Disc.last`. NO_BODY
       if there is none, or if the disc has hit another body (except `corner_ground`) since */
    int corner;
    int corner_ground;
    /* number of changes of the disc's motion without an impact; `Disc.impacts` includes these changes */
    int changes;
    unsigned char mode;      /* Mode */
    unsigned char never_met; /* value of `NeverMet`: which features the disc certainly does not hit */
    bool ends_at_face_end;   /* whether the contact ends because the disc reaches an end of the face */
    bool slip_ends;          /* whether the slip becomes 0 at the instant `ends` */
    bool rim_ends;           /* whether the spin becomes 0 at the instant `ends` */
    bool sticks;             /* whether friction stopped all slip in the disc's last bounce */
    bool rubs;               /* whether the impulse of friction was not 0 in the disc's last bounce */
} Parabola;

typedef struct Ground { /* data of a half-plane or face for a disc in contact with it */
    double x;           /* a point of the surface; for a face, its start */
    double y;
    /* numbers of the vertices at the two ends of a face; NO_OBSTACLE at an end where the wall continues smoothly */
    int over[2];
    int never_first; /* index in `Accelerated.never_lists` of the first feature that a disc on this ground never hits */
    int never_count;
    /* whether PIC solves lasting contact with this feature: false for driven walls and curved features */
    bool is_ground;
} Ground;

typedef struct ModeRow { /* a recorded change of mode, a row of `carom.model.trace.MODE_DTYPE` */
    double time;         /* time of the change, in seconds since the start of the run */
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

typedef struct ContactEnd { /* a contact that PIC does not solve, and that has therefore ended the run */
    Index disc;
    Index other;        /* number of the body with which the disc is in contact */
    int obstacle;       /* obstacle of the body `other`; NO_OBSTACLE if that body is a disc */
    int held_by;        /* another feature that the disc was already in contact with, or NO_OBSTACLE */
    bool after_bounces; /* whether infinitely many bounces preceded this contact */
} ContactEnd;

typedef struct Accelerated {
    Parabola *paths; /* path of each disc; NULL if no disc accelerates */
    Ground *grounds; /* one `Ground` per feature */
    int *never_lists;
    Index never_length;
    double gx; /* gravity */
    double gy;
    double deceleration;       /* deceleration by a table, opposite to each disc's motion; 0 without a table */
    double rolling_resistance; /* coefficient of rolling resistance of discs on walls */
    ExactQuartic exact;
    ModeRow *modes; /* recorded changes of mode */
    Index mode_count;
    Index mode_capacity;
    ContactEnd end;
} Accelerated;
