/* Structs of runs in which discs accelerate: in free fall, in contact with a wall, or on a table that slows them.

   Between two events such a disc has a constant acceleration, so its path is a parabola. Units are those of state.h. */

#pragma once

#include <stdbool.h>
#include <stdint.h>

#include "carom/core/carom_core.h"
#include "carom/core/fall.h"
#include "carom/core/instant.h"

typedef enum Mode { /* how a disc moves; `carom.model.trace.Mode` has the same numbers */
    FLIGHT = 0,
    SLIDE = 1,
    ROLL = 2,
    REST = 3,
    BLOCK = 4, /* it slides without turning */
} Mode;

typedef enum NeverMet { /* which features of a wall a disc does not meet on its path, however it is rounded */
    NEVER_NOTHING = 0,
    NEVER_ALL = 1,  /* all that are listed with the ground that it is in contact with */
    NEVER_FLAT = 2, /* of these the faces and vertices, except one vertex, after it has left the ground over that vertex */
} NeverMet;

typedef struct Parabola { /* of a disc: what its row does not say of its path */
    double ax;            /* acceleration */
    double ay;
    double time_low;   /* of its own instant; the high part is the time of its row */
    double impact_low; /* low parts of the two times of its `Prediction` */
    double exit_low;
    double leaving;   /* speed along the normal after its last impact */
    double spin_rate; /* radians a second squared */
    double entered;   /* when it entered its present cell */
    Instant left;     /* when that was: the gap was 0 then, and the acceleration is constant since */
    double left_speed; /* at which the gap opened */
    Instant ends;     /* when this motion ends by itself: a mode of contact, or a stop on a table */
    int ground;       /* feature that it is in contact with, or NO_OBSTACLE */
    int never_of;     /* feature whose list `never_met` refers to */
    int never_but;    /* vertex that NEVER_FLAT leaves out */
    int left_ground;  /* between two walls: the one that an impact on the other took it off, or NO_OBSTACLE */
    int changes;      /* of its motion that were no impacts: Disc.impacts counts them, too */
    unsigned char mode;      /* Mode */
    unsigned char never_met; /* NeverMet */
    bool ends_at_face_end;   /* whether the contact ends since the face does */
    bool slip_ends;          /* whether the slip is 0 then */
    bool rim_ends;           /* whether the spin is 0 then */
    bool sticks;             /* whether friction has taken all of the slip at its last bounce */
} Parabola;

typedef struct Ground { /* of a half-plane or a face: what a disc in contact with it needs */
    double x;           /* a point of the surface; of a face where it begins */
    double y;
    int over[2];     /* vertex at each end of a face, NO_OBSTACLE where the wall goes on smoothly */
    int never_first; /* place in `Accelerated.never_lists` of what a disc on the face never meets */
    int never_count;
    bool is_ground; /* whether contact that lasts is solved: not of a driven wall, nor of what bends */
} Ground;

typedef struct ModeRow { /* a row of `carom.model.trace.MODE_DTYPE` */
    double time;         /* since the start */
    int64_t impacts;     /* recorded impacts before it */
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

typedef struct ContactEnd { /* how a run has ended in contact that is not solved */
    Index disc;
    Index other;        /* body */
    int obstacle;       /* of that body, NO_OBSTACLE for a disc */
    int held_by;        /* feature that the disc was in contact with before, or NO_OBSTACLE */
    bool after_bounces; /* whether infinitely many impacts came before */
} ContactEnd;

typedef struct Accelerated {
    Parabola *paths; /* of each disc; NULL if all discs move straight */
    Ground *grounds; /* of each feature */
    int *never_lists;
    Index never_length;
    double gx; /* gravity */
    double gy;
    double deceleration;       /* of a table, against the motion of each disc; 0 without */
    double rolling_resistance; /* of discs on walls */
    ExactQuartic exact;
    ModeRow *modes; /* recorded changes of mode */
    Index mode_count;
    Index mode_capacity;
    ContactEnd end;
} Accelerated;
