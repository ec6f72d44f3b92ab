/* Coulomb's law for a disc that gravity presses to a straight wall: it slides, rolls or rests.

   Per unit of mass, with n the wall's normal, t = n turned by -90 degrees (along the wall), u the speed along t, q = R w
   the rim's, the slip s = u + q, k the inertia factor, P > 0 gravity into the wall, a gravity along t, friction f and
   rolling resistance h:

       u' = a - f,    q' = -(f + h) / k,    f in mu P sign(s),    h in c P sign(q).

   Where s is 0, friction holds it there if it can; where q is 0, rolling resistance does. The law has exactly one solution
   forward in time. In an impact of impulse J the same holds of changes of speed for rates. docs/theory/contact.md
   derives it. */

#pragma once

#include <math.h>
#include <stdbool.h>

#include "carom/core/carom_core.h"
#include "carom/core/constants.h"
#include "carom/core/impact.h"

/* What presses a disc to a wall, and what resists. */
typedef struct Press {
    double normal; /* P, above 0: gravity into the wall, m/s2 */
    double along;  /* a: gravity along the wall, m/s2 */
    double friction;
    double inverse_inertia_ratio; /* 1/k, 0 of a disc that does not turn */
    double rolling_resistance;
} Press;

/* What the two frictions take, and what they hold at 0. */
typedef struct Frictions {
    double friction; /* f */
    double rolling;  /* h */
    bool sticks;     /* whether friction holds the slip at 0 */
    bool blocks;     /* whether rolling resistance holds the rim at 0; never of a disc that does not turn */
} Frictions;

/* How the speed along the wall and the rim's speed change, m/s2. */
typedef struct ContactRates {
    double along;
    double rim;
    bool sticks;
    bool blocks;
} ContactRates;

/* Slip and speed of the rim, m/s. */
typedef struct Slips {
    double slip;
    double rim;
} Slips;

static inline double clip(double x, double most) {
    return x > most ? most : x < -most ? -most : x;
}

/* Return f and h with s = s1 - f (1 + y) - h y and q = q1 - (f + h) y, y = 1/k.

   With F and H the most of f and h, f is F where s is above 0, -F where it is below, and between them where it is 0; so
   is h of H and q. q falls as h grows, whatever friction makes of it: at the h that makes it 0, f is s1 - q1 cut to F,
   and cut to H, that h is the law's. `signs` are those that s and q have already, which fix f and h; 0 for none. */
static inline Frictions share_frictions(double s1, double q1, double f_most, double h_most, double y, Slips signs) {
    double f = 0.0, h = 0.0;
    bool blocks = false;
    if (y != 0.0 && signs.rim != 0.0) {
        h = signs.rim > 0.0 ? h_most : -h_most;
    } else if (y != 0.0 && h_most != 0.0) {
        f = signs.slip == 0.0 ? clip(s1 - q1, f_most) : signs.slip > 0.0 ? f_most : -f_most;
        h = clip(q1 / y - f, h_most);
        blocks = fabs(q1 / y - f) <= h_most;
    }
    if (signs.slip != 0.0) {
        return (Frictions){signs.slip > 0.0 ? f_most : -f_most, h, false, blocks};
    }
    const double left = s1 - h * y;
    if (fabs(left) <= f_most * (1.0 + y)) {
        return (Frictions){left / (1.0 + y), h, true, blocks};
    }
    return (Frictions){left > 0.0 ? f_most : -f_most, h, false, blocks};
}

/* Return the rates of a disc in contact. A slip or a rim's speed that is 0 by the law is passed as 0: rounding must not
   decide it. */
static inline ContactRates contact_rates(const Press *press, Slips now) {
    const double y = press->inverse_inertia_ratio;
    const double f_most = press->friction * press->normal;
    const double h_most = press->rolling_resistance * press->normal;
    const Slips signs = {now.slip, h_most != 0.0 ? now.rim : 0.0};
    const Frictions by = share_frictions(press->along, 0.0, f_most, h_most, y, signs);
    const double turns = by.blocks ? 0.0 : 0.0 - (by.friction + by.rolling) * y;
    if (by.sticks) {
        return (ContactRates){0.0 - turns, turns, true, by.blocks};
    }
    return (ContactRates){press->along - by.friction, turns, false, by.blocks};
}

/* Return the impulses of both frictions in an impact on a wall, a unit of mass; `pressed` is the normal one, 0 or more.
   With rolling resistance friction gives back nothing of a slip. */
static inline Frictions frictional_impulses(
    const ContactFriction *contact, double rolling_resistance, Slips before, double y, double pressed
) {
    if (rolling_resistance != 0.0) {
        const Slips free = {0.0, 0.0};
        return share_frictions(
            before.slip, before.rim, contact->friction * pressed, rolling_resistance * pressed, y, free
        );
    }
    const bool sticks = fabs((1.0 + contact->restitution) * before.slip / (1.0 + y)) <= contact->friction * pressed;
    return (Frictions){tangential_impulse(contact, before.slip, 1.0 + y, pressed), 0.0, sticks, false};
}

/* Return after how many seconds a slip, or a rim's speed, of this rate is 0; infinity for never. */
static inline double time_to_zero(double value, double rate) {
    return value != 0.0 && value * rate < 0.0 ? -value / rate : CAROM_INF;
}

/* Return the slip at the end of the infinitely many bounces that begin now.

   Bounce n comes at w e^n. Sliding, it takes C w e^n off the slip, C = f (1 + e)(1 + 1/k), and the hop after it adds
   2 a e w e^n / P. So bounces that slide one way change the slip by (2 a e / P - C sign(s)) w / (1 - e) in all, and if a
   slip of that sign is left none of them holds it. Else one does, or it turns round in a hop, and from there on it is as
   small as the bounces are: nothing is left. `approach` is w, the speed at which the disc comes, `restitution` e < 1. */
static inline double slip_after_bounces(const Press *press, double slip, double approach, double restitution) {
    if (slip == 0.0) {
        return 0.0;
    }
    const double most = press->friction * (1.0 + restitution) * (1.0 + press->inverse_inertia_ratio);
    const double a_hop = 2.0 * press->along * restitution / press->normal;
    if (fabs(slip) <= most * approach) { /* held by the first of them; the second slides if the hop between gives more */
        if (fabs(a_hop) <= most * restitution) {
            return 0.0;
        }
        slip = a_hop * approach;
        approach = approach * restitution;
    }
    const double sign = slip > 0.0 ? 1.0 : -1.0;
    const double left = slip + (a_hop - sign * most) * approach / (1.0 - restitution);
    return left * sign > 0.0 ? left : 0.0;
}

/* Return slip and rim's speed after infinitely many bounces with rolling resistance, which the clock can't tell apart.

   All their impulses are taken as one, (1 + e) w / (1 - e), and all that their hops add to it: so the law of impact gives
   an end that rest and rolling are ends of, too. What that leaves out is as small as these bounces are. */
static inline Slips both_after_bounces(const Press *press, Slips now, double approach, double restitution) {
    const double y = press->inverse_inertia_ratio, left = approach / (1.0 - restitution);
    const double pressed = (1.0 + restitution) * left, fallen = 2.0 * restitution * left / press->normal;
    const double s1 = now.slip + press->along * fallen;
    const Slips free = {0.0, 0.0};
    const Frictions by = share_frictions(
        s1, now.rim, press->friction * pressed, press->rolling_resistance * pressed, y, free
    );
    return (Slips){
        by.sticks ? 0.0 : s1 - by.friction * (1.0 + y) - by.rolling * y,
        by.blocks ? 0.0 : now.rim - (by.friction + by.rolling) * y,
    };
}
