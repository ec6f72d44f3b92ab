/* Crushes: two bodies approach each other, and a disc bounces to and fro between them until no space is left. After
   more than `State.standstill` successive impacts on two opposite bodies, a rule decides whether and when the disc is
   crushed.

   Suppose that a disc bounces between two parallel walls, one of which moves towards the other. Let v be the disc's
   speed relative to the moving wall, and g the space left for the disc. The product v g is the same after each impact
   on the moving wall. So v is proportional to 1/g, and infinitely many impacts occur before no space is left. Time
   advances at every impact, so the limit on impacts at one instant does not end the run. The page docs/theory/walls.md
   derives the rule. A row of discs between two bodies that impacts do not move is crushed like a single disc. */

#pragma once

#include "carom/core/pic/crush_bodies.h"
#include "carom/core/pic/crushed_row.h"

/* ---- one disc between two walls ---- */

typedef struct Drift { /* motion of a disc along a wall, to the right of the wall's normal */
    double velocity;
    double pull; /* acceleration along the wall */
} Drift;

/* drift is motion along a wall. If `count` is 1, `drift[0]` is the exact drift; if `count` is 2, `drift` contains a
   lower and an upper bound of the drift; if `count` is 0, nothing is known */
typedef struct Drifts {
    Drift drift[2];
    int count;
} Drifts;

/* Return bounds of disc `i`'s motion along wall `k` while the disc bounces between this wall and wall `other`.

   Without friction, impacts do not change the disc's velocity along the wall. With friction, there is one velocity u
   and one spin w at which the disc slips on neither wall. Friction in an impact reduces the slip, and at most reverses
   the slip. The kinetic energy computed with the differences from u and w never grows, and this energy bounds the
   velocity. */
static inline Drifts drifts_along(const State *s, Index i, Index k, Index other, const Leg *leg, const Leg *other_leg) {
    const Disc *a = &s->discs[i];
    double nx = s->to_and_fro[i].nx, ny = s->to_and_fro[i].ny;
    double now = a->vx * ny - a->vy * nx;
    double pull = s->accelerated.gx * ny - s->accelerated.gy * nx;
    if (!rubs_on(s, k) && !rubs_on(s, other))
        return (Drifts){{{now, pull}}, 1};
    double one = leg->vx * ny - leg->vy * nx - belt_of(s, k);
    double two = other_leg->vx * ny - other_leg->vy * nx + belt_of(s, other);
    double steady = (one + two) / 2.0;
    double off = a->radius * stored_spin(s, i) - (one - two) / 2.0;
    double inverse_inertia_ratio = s->turning == NULL ? 0.0 : s->turning[i].inverse_inertia_ratio;
    if (off != 0.0 && inverse_inertia_ratio == 0.0)
        return (Drifts){.count = 0};
    double turning = off != 0.0 ? off * off / inverse_inertia_ratio : 0.0;
    double most = sqrt((now - steady) * (now - steady) + turning);
    return (Drifts){{{steady - most, -fabs(pull)}, {steady + most, fabs(pull)}}, 2};
}

/* Return the feature of wall `wall` that disc `i` hit in its last two impacts. Return NULL if the feature is neither a
   half-plane nor a face. */
static inline const Feature *flat_feature(const State *s, Index i, Index wall) {
    const ToAndFro *t = &s->to_and_fro[i];
    int bodies[2] = {t->last, t->across}, obstacles[2] = {t->last_obstacle, t->across_obstacle};
    for (int n = 0; n < 2; n++) {
        if (bodies[n] == -1 - wall && s->features[obstacles[n]].kind <= FACE)
            return &s->features[obstacles[n]];
    }
    return NULL;
}

/* Return whether disc `i` stays between the ends of a flat feature for `seconds`, with each of the given drifts along
   the tangent (tx, ty). */
static inline bool stays_before(const State *s, Index i, const Feature *face, double tx, double ty,
                                const Drifts *drifts, double seconds) {
    if (face->kind == PLANE)
        return true;
    const Disc *a = &s->discs[i];
    Motion seen = motion_seen_from_wall(s, i, face->wall);
    double ex = face->fx.high - face->x.high, ey = face->fy.high - face->y.high;
    double now = (seen.x - face->x.high) * ex + (seen.y - face->y.high) * ey;
    double way = tx * ex + ty * ey;
    /* present velocity of the wall along the tangent */
    double own = (a->vx - seen.vx) * tx + (a->vy - seen.vy) * ty;
    for (int n = 0; n < drifts->count; n++) {
        double rate = (drifts->drift[n].velocity - own) * way, bend = drifts->drift[n].pull * way;
        double turn = bend != 0.0 ? -rate / bend : 0.0;
        double times[3] = {0.0, seconds, 0.0 < turn && turn < seconds ? turn : 0.0};
        for (int k = 0; k < 3; k++) {
            double place = now + times[k] * (rate + 0.5 * bend * times[k]);
            if (!(0.0 <= place && place <= ex * ex + ey * ey))
                return false;
        }
    }
    return true;
}

static inline bool is_one_of_two(const State *s, const void *bodies, Index body) {
    (void)s;
    const Index *two = bodies;
    return body == two[0] || body == two[1];
}

/* Disc `i` has just hit wall `k`. Return whether the disc is crushed between flat features of walls `k` and `other`. If
   the disc is crushed, set `crush`.

   Before the crush, no other body may come near, no wall may begin another leg (straight part of its path), and the
   disc must not pass an end of a feature. */
static inline bool find_crush_between(const State *s, Index i, Index k, Index other, Crush *crush) {
    const Disc *a = &s->discs[i];
    double nx = s->to_and_fro[i].nx, ny = s->to_and_fro[i].ny;
    const Leg *leg = legs_ahead(s, -1 - k, a->time).legs, *other_leg = legs_ahead(s, -1 - other, a->time).legs;
    double closing = (leg->vx - other_leg->vx) * nx + (leg->vy - other_leg->vy) * ny;
    const Feature *flat = flat_feature(s, i, k), *opposite = flat_feature(s, i, other);
    if (!(closing > 0.0) || flat == NULL || opposite == NULL)
        return false;
    Motion seen = motion_seen_from_wall(s, i, other);
    Mover mover = mover_at(seen.x, seen.y, seen.vx, seen.vy, a->radius);
    double gap = opposite->kind == PLANE ? room_to_feature(opposite, &seen, a->radius)
                                         : face_gap(&mover, opposite).high / opposite->size.high;
    double left = gap / closing;
    Drifts drifts = drifts_along(s, i, k, other, leg, other_leg);
    if (drifts.count == 0 || leg->end <= a->time + left || other_leg->end <= a->time + left)
        return false;
    double slip = greater(fabs(drifts.drift[0].velocity), fabs(drifts.drift[drifts.count - 1].velocity)) +
                  greater(nearest_length(leg->vx, leg->vy), nearest_length(other_leg->vx, other_leg->vy));
    Index sides[2] = {-1 - (k < other ? k : other), -1 - (k < other ? other : k)};
    if (is_disturbed(s, i, is_one_of_two, sides, gap + left * slip, left) ||
        !stays_before(s, i, flat, ny, -nx, &drifts, left) || !stays_before(s, i, opposite, ny, -nx, &drifts, left))
        return false;
    *crush = (Crush){i, {sides[0], sides[1]}, a->time + left};
    return true;
}

/* ---- the rule ---- */

/* Return whether a disc that has just hit a body is crushed. If the disc is crushed, set `crush`. `Crush.time` is in
   seconds since the present epoch. */
static inline bool find_crush(const State *s, Index i, Crush *crush) {
    const ToAndFro *t = &s->to_and_fro[i];
    /* the disc has hit one other disc repeatedly, but no body on the opposite side */
    if (t->last == NO_BODY || t->across == NO_BODY)
        return false;
    if (t->last < 0 && t->across < 0 && find_crush_between(s, i, -1 - t->last, -1 - t->across, crush))
        return true;
    return find_crush_in_row(s, i, crush);
}

/* ---- impacts in succession ---- */

/* Count an impact of a disc on a body. The normal (nx, ny) points from the body to the disc. Return whether the disc
   bounces to and fro. */
static inline bool goes_to_and_fro(ToAndFro *t, int body, int obstacle, double nx, double ny) {
    bool is_opposite = t->last != NO_BODY && t->last != body && t->nx == -nx && t->ny == -ny;
    if (is_opposite) {
        t->across = t->last;
        t->across_obstacle = t->last_obstacle;
    } else if (!(body >= 0 && t->last == body && t->nx == nx && t->ny == ny)) {
        t->across = NO_BODY;
        t->row = -1;
    }
    t->last = body;
    t->last_obstacle = obstacle;
    t->nx = nx;
    t->ny = ny;
    t->row += 1;
    return t->row > 0;
}

/* Return whether a disc that bounces to and fro is crushed before the requested end of the run. If the disc is crushed,
   set `State.crush`. */
static CAROM_NOINLINE bool is_crushed(State *s, Index disc) {
    Crush crush;
    if (!find_crush(s, disc, &crush))
        return false;
    crush.time = s->clock.epoch + (s->clock.epoch_rest + crush.time);
    if (crush.time > s->until)
        return false;
    s->crush = crush;
    return true;
}

/* Count an impact of a movable disc on a body. Return whether the disc is crushed before the requested end of the
   run. */
static inline bool is_crushed_by(State *s, Index disc, Index body, int obstacle, double nx, double ny) {
    ToAndFro *t = &s->to_and_fro[disc];
    return goes_to_and_fro(t, (int)body, obstacle, nx, ny) && t->row > s->standstill && is_crushed(s, disc);
}

/* Count an impact of two discs. Return whether one of the two discs is crushed. */
static inline bool is_one_crushed(State *s, Index i, Index j) {
    const Disc *a = &s->discs[i];
    const Disc *b = &s->discs[j];
    double dx = b->x - a->x;
    double dy = b->y - a->y;
    double distance = sqrt(dx * dx + dy * dy);
    double nx = dx / distance;
    double ny = dy / distance;
    bool is_first = a->inverse_mass > 0.0 && is_crushed_by(s, i, j, NO_OBSTACLE, -nx, -ny);
    bool is_second = b->inverse_mass > 0.0 && is_crushed_by(s, j, i, NO_OBSTACLE, nx, ny);
    return is_first || is_second;
}
