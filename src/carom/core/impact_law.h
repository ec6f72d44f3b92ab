/* The impact law: restitution along the normal, friction along the tangent.

   - Each function applies one impact and changes velocities and spins in place. The solvers have different structs for
     a disc, so the functions take a pointer to the velocity, and nothing is copied.
   - The caller decides whether and when bodies collide. In the TC model, the caller also decides whether the impact
     loses energy (`elastic`).
   - No unit vector is used. Let d point from centre to centre, and let u be the velocity of the second body relative to
     the first. The normal impulse is g d with a factor g, so rounding of the length of d adds no energy. The tangential
     impulse is h times d turned by +90 degrees.
   - An impact never pulls the bodies together. If rounding makes the bodies of a very weak graze separate, the impulse
     is 0.
   - `has_spins` is a constant at each call, so the code for spins costs no time in a scene without spins. The functions
     are inlined, because calls through a pointer slow the event loop down by a tenth.

   Let n be the unit normal from body 1 to body 2, and t = n turned by +90 degrees. Bodies have velocities v, masses m,
   radii R, counterclockwise spins w, and moments of inertia k m R^2. With the restitution e, the normal impulse is J =
   (1 + e) (v1 - v2).n / (1/m1 + 1/m2). The surface of body 1 moves past that of body 2 with the slip

       s = (v1 - v2).t + R1 w1 + R2 w2.

   The tangential impulse T acts along -t on body 1 and along t on body 2. With the tangential restitution b, T changes
   the slip to -b times its previous value, unless Coulomb's limit f J makes T smaller, where f is the coefficient of
   friction. Here clip(x, a, b) limits x to the range from a to b:

       T = clip((1 + b) s / ((1 + 1/k1)/m1 + (1 + 1/k2)/m2), -f J, f J)

       v1' = v1 - T t / m1,   v2' = v2 + T t / m2,   R1 w1' = R1 w1 - T / (k1 m1),   R2 w2' = R2 w2 - T / (k2 m2)

   The law with the three parameters e, f and b is by Walton, Mech. Mater. 16 (1993) 239, and Foerster, Louge, Chang and
   Allia, Phys. Fluids 6 (1994) 1108. b = 0 is Coulomb's law alone. b = 1 with enough friction is Garwin's superball
   (Am. J. Phys. 37 (1969) 88). A wall and an immovable disc have 1/m = 0. docs/theory/pic.md and
   docs/theory/friction.md derive both impulses. Tests compare results bit by bit, so no operation may be reordered or
   fused. */

#pragma once

#include <math.h>

#include "carom/core/carom_core.h"

/* ---- impulses ---- */

/* Return the factor g of the normal impulse, 0 or less. With d from the first centre to the second, the first disc
   receives the impulse g d, and the second disc receives -g d. */
static inline double normal_impulse(double dx, double dy, double ux, double uy, double inverse_masses,
                                    double restitution) {
    double along = dx * ux + dy * uy;
    if (!(along < 0.0))
        return 0.0;
    return (1.0 + restitution) * along / ((dx * dx + dy * dy) * inverse_masses);
}

/* Return the impulse of friction. The impulse makes the surfaces stick, but is at most Coulomb's limit. */
static inline double tangential_impulse(const ContactFriction *contact, double slip, double inverse_effective_mass,
                                        double pressed) {
    double sticking = (1.0 + contact->restitution) * slip / inverse_effective_mass;
    double most = contact->friction * pressed;
    if (sticking > most)
        return most;
    return sticking < -most ? -most : sticking;
}

/* Return the factor h of the impulse of friction. The first disc receives the impulse h (dy, -dx), where d points from
   the first centre to the second. `surface` is |d| (R1 w1 + R2 w2), with radii R and spins w. */
static inline double pair_tangential_impulse(const ContactFriction *contact, double dx, double dy, double ux, double uy,
                                             double surface, double inverse_effective_mass, double normal) {
    return tangential_impulse(contact, dy * ux - dx * uy + surface, (dx * dx + dy * dy) * inverse_effective_mass,
                              -normal);
}

/* ---- two discs ---- */

/* Apply an impact without friction to the velocities of two discs. d points from the first centre to the second. Return
   the factor g of the normal impulse g d. */
static inline double bounce_pair(double dx, double dy, double *v1, double inverse_mass1, double *v2,
                                 double inverse_mass2, double restitution) {
    double g =
        normal_impulse(dx, dy, v2[0] - v1[0], v2[1] - v1[1], inverse_mass1 + inverse_mass2, restitution);
    v1[0] += g * inverse_mass1 * dx;
    v1[1] += g * inverse_mass1 * dy;
    v2[0] -= g * inverse_mass2 * dx;
    v2[1] -= g * inverse_mass2 * dy;
    return g;
}

/* Apply friction to two discs, after their normal impulse g d. u is their relative velocity before the impact. */
static inline void apply_pair_friction(const ContactFriction *contact, double dx, double dy, double ux, double uy,
                                       double g, Body *a, Body *b) {
    double distance = sqrt(dx * dx + dy * dy);
    double surface = distance * (a->radius * a->turning->spin + b->radius * b->turning->spin);
    double inverse_effective_mass = a->inverse_mass * (1.0 + a->turning->inverse_inertia_ratio) +
                                          b->inverse_mass * (1.0 + b->turning->inverse_inertia_ratio);
    double h = pair_tangential_impulse(contact, dx, dy, ux, uy, surface, inverse_effective_mass, g);
    a->velocity[0] += h * a->inverse_mass * dy;
    a->velocity[1] -= h * a->inverse_mass * dx;
    b->velocity[0] -= h * b->inverse_mass * dy;
    b->velocity[1] += h * b->inverse_mass * dx;
    a->turning->spin -= h * distance * a->inverse_mass * a->turning->inverse_inertia_ratio / a->radius;
    b->turning->spin -= h * distance * b->inverse_mass * b->turning->inverse_inertia_ratio / b->radius;
}

/* Apply the impact of two discs in contact. d points from the first centre to the second. Return the factor g of the
   normal impulse g d.

   If `elastic` is true, no energy is lost and no friction acts. `spins` is written only if `has_spins` is true. */
static inline double collide_discs(const Law *law, double dx, double dy, Body *a, Body *b, bool elastic, bool has_spins,
                                   Spins *spins) {
    double ux = b->velocity[0] - a->velocity[0];
    double uy = b->velocity[1] - a->velocity[1];
    double g = bounce_pair(dx, dy, a->velocity, a->inverse_mass, b->velocity, b->inverse_mass,
                                 elastic ? 1.0 : law->restitution);
    if (has_spins) {
        spins->first_before = a->turning->spin;
        spins->second_before = b->turning->spin;
        if (law->contact.friction > 0.0 && !elastic)
            apply_pair_friction(&law->contact, dx, dy, ux, uy, g, a, b);
        spins->first_after = a->turning->spin;
        spins->second_after = b->turning->spin;
    }
    return g;
}

/* ---- a disc and a wall ---- */

/* Apply the impact of a disc on a wall, by the same rules as `collide_discs`. Return the normal component of the disc's
   velocity relative to the wall before the impact, which is positive away from the wall. */
static inline double collide_wall(const Law *law, const Wall *wall, const Surface *surface, Body *a, bool elastic,
                                  bool has_spins, Spins *spins) {
    double vx = a->velocity[0];
    double vy = a->velocity[1];
    if (surface != NULL) {
        vx -= surface->vx;
        vy -= surface->vy;
    }
    double along = vx * wall->nx + vy * wall->ny;
    double speed = 0.0;
    if (along < 0.0) {
        speed = (1.0 + (elastic ? 1.0 : law->wall_restitution)) * along;
        a->velocity[0] -= speed * wall->nx;
        a->velocity[1] -= speed * wall->ny;
    }
    if (has_spins) {
        *spins = (Spins){a->turning->spin, 0.0, 0.0, 0.0};
        if (law->wall_contact.friction > 0.0 && along < 0.0 && !elastic) {
            double slip = vx * wall->ny - vy * wall->nx + a->radius * a->turning->spin;
            if (surface != NULL && surface->belt != 0.0)
                slip += surface->belt;
            double h =
                tangential_impulse(&law->wall_contact, slip, 1.0 + a->turning->inverse_inertia_ratio, -speed);
            a->velocity[0] -= h * wall->ny;
            a->velocity[1] += h * wall->nx;
            a->turning->spin -= h * a->turning->inverse_inertia_ratio / a->radius;
        }
        spins->first_after = a->turning->spin;
    }
    return along;
}
