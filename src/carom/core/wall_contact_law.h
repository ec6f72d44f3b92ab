/* Coulomb's law for a disc that gravity presses against a straight wall: the disc slides, rolls or rests.

   All quantities are per unit of mass. The wall has the normal n and the tangent t, which is n turned by -90 degrees.
   The disc has the speed u along t, the rim speed q = R w (radius times spin), and the slip s = u + q. The inertia
   factor is k. Gravity has the component P > 0 into the wall and a along t. The coefficient of friction is mu, and that
   of rolling resistance is c. The law with friction f and rolling resistance h is

       u' = a - f,    q' = -(f + h) / k,    f in mu P sign(s),    h in c P sign(q).

   If s is 0, f takes the value within its limits that keeps s at 0, if there is one. If q is 0, h keeps q at 0 in the
   same way. The law has exactly one solution forward in time. For an impact, the same law is true with changes of speed
   instead of rates, and with the normal impulse instead of P. docs/theory/contact.md derives the law. */

#pragma once

#include "carom/core/constants.h"
#include "carom/core/impact_law.h"

/* The forces on a disc in contact with a wall: gravity, friction and rolling resistance. */
typedef struct Press {
    double normal; /* P, above 0: gravity into the wall, m/s^2 */
    double along;  /* a: gravity along the wall, m/s^2 */
    double friction;
    double inverse_inertia_ratio; /* 1/k; 0 for a disc that does not turn */
    double rolling_resistance;
} Press;

/* The two friction forces or impulses, and whether they keep the slip and the rim speed at 0. */
typedef struct Frictions {
    double friction; /* f */
    double turning;  /* f + h: the rim speed changes by -(f + h) / k */
    bool sticks;     /* whether friction keeps the slip at 0 */
    bool blocks;     /* whether rolling resistance keeps the rim speed at 0; false for a disc that does not turn */
} Frictions;

/* Rates of the speed along the wall and of the rim speed, m/s^2. */
typedef struct ContactRates {
    double along;
    double rim;
    bool sticks;
    bool blocks;
} ContactRates;

/* Slip and rim speed, m/s. */
typedef struct Slips {
    double slip;
    double rim;
} Slips;

static inline double clip(double x, double most) {
    return x > most ? most : x < -most ? -most : x;
}

/* Return f and h with s = s1 - f (1 + y) - h y and q = q1 - (f + h) y, where y = 1/k. The slip s and the rim speed q
   are s1 and q1 before friction f and rolling resistance h act.

   F and H are the largest magnitudes of f and h (`f_most`, `h_most`). If s is positive, f is F. If s is negative, f is
   -F. If s is 0, f is from -F to F. In the same way, h depends on H and q. To find h, assume that q = 0. With this
   assumption, f is s1 - q1, limited to [-F, F]. Solve q = 0 for h, and limit h to [-H, H]. The result is the h of the
   law, because q decreases as h grows. If s is not 0 before friction acts, its sign determines f. In the same way, q
   determines h. `signs` contains numbers with the signs of s and q, or 0 where the sign does not determine the
   friction. If s becomes 0, f + h is computed as (s1 + h) / (1 + y). If q becomes 0, f + h is computed as q1 / y.
   Adding f and h would lose digits for large y. */
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
        f = signs.slip > 0.0 ? f_most : -f_most;
        return (Frictions){f, blocks ? q1 / y : f + h, false, blocks};
    }
    const double left = s1 - h * y;
    if (fabs(left) <= f_most * (1.0 + y)) {
        return (Frictions){left / (1.0 + y), (s1 + h) / (1.0 + y), true, blocks};
    }
    f = left > 0.0 ? f_most : -f_most;
    return (Frictions){f, blocks ? q1 / y : f + h, false, blocks};
}

/* Return the rates of change of both speeds of a disc in contact. A slip or rim speed that the law makes 0 must be
   exactly 0 in `now`. */
static inline ContactRates contact_rates(const Press *press, Slips now) {
    const double y = press->inverse_inertia_ratio;
    const double f_most = press->friction * press->normal;
    const double h_most = press->rolling_resistance * press->normal;
    const Slips signs = {now.slip, h_most != 0.0 ? now.rim : 0.0};
    const Frictions by = share_frictions(press->along, 0.0, f_most, h_most, y, signs);
    const double turns = by.blocks ? 0.0 : 0.0 - by.turning * y;
    if (by.sticks) {
        return (ContactRates){0.0 - turns, turns, true, by.blocks};
    }
    return (ContactRates){press->along - by.friction, turns, false, by.blocks};
}

/* Return the impulses of friction and rolling resistance in an impact on a wall, per unit of mass. `pressed` is the
   normal impulse, 0 or more. With rolling resistance, friction does not reverse a slip: the tangential restitution is
   not used. */
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
    const double impulse = tangential_impulse(contact, before.slip, 1.0 + y, pressed);
    return (Frictions){impulse, impulse, sticks, false};
}

/* Apply friction and rolling resistance to a disc in an impact on a wall with the normal n and the surface speed
   `belt`. u is the velocity of the disc relative to the wall before the impact. */
static inline Frictions rub_on_wall(const ContactFriction *contact, double rolling_resistance, double belt, double nx,
                                    double ny, double ux, double uy, double pressed, Body *a) {
    Turning *turning = a->turning;
    const double y = turning->inverse_inertia_ratio, rim = a->radius * turning->spin;
    double slip = ux * ny - uy * nx + rim;
    if (belt != 0.0)
        slip += belt;
    const Frictions by = frictional_impulses(contact, rolling_resistance, (Slips){slip, rim}, y, pressed);
    a->velocity[0] -= by.friction * ny;
    a->velocity[1] += by.friction * nx;
    turning->spin = by.blocks ? 0.0 : turning->spin - by.turning * y / a->radius;
    return by;
}

/* Return the seconds until a slip or rim speed `value`, which changes at the constant `rate`, is 0; infinity for
   never. */
static inline double time_to_zero(double value, double rate) {
    return value != 0.0 && value * rate < 0.0 ? -value / rate : CAROM_INF;
}

/* Return the slip after the infinitely many bounces that begin now.

   The normal speed w of the disc is `approach`, the restitution e < 1 is `restitution`, and n = 0, 1, 2, ... counts
   bounces. Bounce n has the normal speed w e^n. If the disc slides during the whole bounce, the bounce reduces the slip
   by C w e^n, where C = f (1 + e)(1 + 1/k). The flight after bounce n adds 2 a e w e^n / P to the slip. Bounces that
   slide in one direction therefore change the slip by (2 a e / P - C sign(s)) w / (1 - e) in all. If a slip of the same
   sign remains, no bounce stops it. If no slip of this sign remains, a bounce stops it, or a flight reverses it. After
   the first bounce that does not slide throughout, the slip is at most proportional to the speeds of the bounces, which
   tend to 0. So no slip remains at the end. */
static inline double slip_after_bounces(const Press *press, double slip, double approach, double restitution) {
    if (slip == 0.0) {
        return 0.0;
    }
    const double most = press->friction * (1.0 + restitution) * (1.0 + press->inverse_inertia_ratio);
    const double a_hop = 2.0 * press->along * restitution / press->normal;
    /* The first bounce stops the slip. In the second bounce, the disc slides if the flight between these bounces adds
       more slip than the second bounce can stop. */
    if (fabs(slip) <= most * approach) {
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

/* Return the slip and rim speed after infinitely many bounces with rolling resistance. All remaining bounces together
   take less time than the resolution of times.

   The result is an approximation. The changes of speed in all flights between bounces are applied first. Then the
   impulses of all bounces, (1 + e) w / (1 - e) in all, are applied as one impulse. The law of impact then gives the
   result, which may be rest or rolling. The error of the approximation is proportional to the speed w of the first
   bounce. */
static inline Slips both_after_bounces(const Press *press, Slips now, double approach, double restitution) {
    const double y = press->inverse_inertia_ratio, left = approach / (1.0 - restitution);
    const double pressed = (1.0 + restitution) * left, fallen = 2.0 * restitution * left / press->normal;
    const double s1 = now.slip + press->along * fallen;
    const Slips free = {0.0, 0.0};
    const Frictions by = share_frictions(
        s1, now.rim, press->friction * pressed, press->rolling_resistance * pressed, y, free
    );
    return (Slips){
        by.sticks ? 0.0 : s1 - by.friction - by.turning * y,
        by.blocks ? 0.0 : now.rim - by.turning * y,
    };
}
