/* Structs for discs that accelerate: in free fall, in contact with a wall, or on a table that slows them down.

   Between two events, a disc's acceleration is constant, so its path is a parabola. Units are the same as in
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

typedef enum NeverMet { /* features of a wall that a disc certainly never hits on its present path */
    NEVER_NOTHING = 0,
    /* all features in the list of the ground `Parabola.never_of`, with which the disc is in contact */
    NEVER_ALL = 1,
    /* faces and vertices in the list of the ground `Parabola.never_of`, except the vertex at which the disc left this
       ground */
    NEVER_FLAT = 2,
} NeverMet;

typedef struct Parabola { /* path of a disc: data that are not in `Disc` */
    double ax;            /* acceleration, in metres per second squared */
    double ay;
    /* low part of the instant at which the path began; the high part is `Disc.time` */
    double time_low;
    /* `impact_low` and `exit_low`: low parts of `Prediction.impact_time` and `Prediction.exit_time` */
    double impact_low;
    double exit_low;
    /* speed along the normal just after the disc's last impact, in metres per second */
    double leaving;
    /* rate of change of the spin, in radians per second squared */
    double spin_rate;
    /* time at which the disc entered its present cell */
    double entered;
    /* instant of the disc's last impact while it was in contact with a ground (half-plane or face); the gap to
       `left_ground` is computed from `left` and `left_speed` */
    Instant left;
    /* speed at which the disc left `left_ground` at the instant `left` */
    double left_speed;
    /* signed distance of the disc from the position at which it also touches `corner`, measured along
       `corner_ground` */
    double corner_way;
    /* instant at which a mode of contact ends without an impact, or at which the disc stops on a table */
    Instant ends;
    /* the feature with which the disc is in contact, or NO_OBSTACLE */
    int ground;
    /* the ground to whose list of features `never_met` refers */
    int never_of;
    /* if `never_met` is NEVER_FLAT: the vertex that the disc can hit */
    int never_but;
    /* the ground from which an impact on another body has lifted the disc, or NO_OBSTACLE */
    int left_ground;
    /* the last convex body at rest that the disc hit while in contact with `corner_ground`, numbered like `Disc.last`.
       NO_BODY if there is no such body, or if the disc has since hit a third body */
    int corner;
    int corner_ground;
    /* number of changes of the disc's motion without an impact, which `Disc.impacts` also counts */
    int changes;
    unsigned char mode;      /* Mode */
    unsigned char never_met; /* a `NeverMet`: which features the disc certainly does not hit */
    bool ends_at_face_end;   /* whether `ends` is the instant at which the disc reaches an end of its face */
    bool slip_ends;          /* whether the slip becomes 0 at the instant `ends` */
    bool rim_ends;           /* whether the spin becomes 0 at the instant `ends` */
    bool sticks;             /* whether friction stopped the slip in the disc's last bounce on a wall */
    bool rubs;               /* whether friction acted in the disc's last bounce on a wall */
} Parabola;

typedef struct Ground { /* data of a half-plane or face for a disc in contact with it */
    double x;           /* a point of the surface; for a face, its start */
    double y;
    /* vertices at the two ends of a face; NO_OBSTACLE at an end where the wall continues smoothly */
    int over[2];
    /* index in `Accelerated.never_lists` of the first feature that a disc on the ground never hits */
    int never_first;
    int never_count;
    /* whether PIC solves lasting contact with the feature: false for driven walls and curved features */
    bool is_ground;
} Ground;

typedef struct ModeRow { /* a recorded change of mode (kind of motion), a row of `carom.model.trace.MODE_DTYPE` */
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

typedef struct ContactEnd { /* a contact that has ended the run, because PIC does not solve it */
    Index disc;
    Index other;        /* number of the body that the disc touches */
    int obstacle;       /* obstacle of the body `other`; NO_OBSTACLE if that body is a disc */
    int held_by;        /* another feature with which the disc was already in contact, or NO_OBSTACLE */
    bool after_bounces; /* whether infinitely many bounces preceded this contact */
} ContactEnd;

typedef struct Accelerated {
    Parabola *paths; /* path of each disc; NULL if no disc accelerates */
    Ground *grounds; /* one `Ground` per feature */
    int *never_lists;
    Index never_length;
    double gx; /* gravity */
    double gy;
    double deceleration;       /* deceleration by a table, opposite to each disc's velocity; 0 without a table */
    double rolling_resistance; /* coefficient of rolling resistance of discs on walls */
    ExactQuartic exact;
    ModeRow *modes;
    Index mode_count;
    Index mode_capacity;
    ContactEnd end;
} Accelerated;
