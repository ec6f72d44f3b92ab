/* Motion of discs that gravity presses against a wall, and the instants at which this motion changes.

   A disc in contact has a constant acceleration along the wall, so its path is a parabola. So the functions for discs
   in flight also predict the events of discs in contact. The law makes some quantities 0: the gap and the normal speed
   of a disc in contact, and the slip of a rolling disc. Quantities that the law makes 0 are set to exactly 0 and not
   computed. The page docs/theory/contact.md derives the law. */

#pragma once

#include "carom/core/wall_contact_law.h"
#include "carom/core/pic/parabola_motion.h"

/* ---- the ground: the half-plane or face that a disc is in contact with ---- */

static inline double slip_on(const State *s, Index i, const Feature *ground) {
    const Disc *a = &s->discs[i];
    return a->vx * ground->ny - a->vy * ground->nx + a->radius * s->turning[i].spin;
}

static inline double rim_speed(const State *s, Index i) {
    return s->discs[i].radius * s->turning[i].spin;
}

static inline double ground_approach(const State *s, Index i, const Feature *ground) {
    return -wall_speed(s->discs[i].vx, s->discs[i].vy, ground->nx, ground->ny).high;
}

/* Return the distance of a disc's rim from the surface of its ground. */
static inline double ground_gap(const State *s, Index i, Index k) {
    const Disc *a = &s->discs[i];
    const Feature *f = &s->features[k];
    const Ground *g = &s->accelerated.grounds[k];
    return wall_gap(a->x, a->y, a->radius, g->x, g->y, f->nx, f->ny).high;
}

static inline double ground_gap_resolution(const State *s, Index i, Index k) {
    const Disc *a = &s->discs[i];
    const Ground *g = &s->accelerated.grounds[k];
    return gap_resolution(size_of(a->x, a->y, a->radius) + size_of(g->x, g->y, 0.0));
}

/* Move a disc by the rounding error of the gap to its ground, so that the gap is 0. */
static inline void place_on_wall(State *s, Index i, Index k) {
    Disc *a = &s->discs[i];
    const Feature *f = &s->features[k];
    double gap = ground_gap(s, i, k);
    a->x -= gap * f->nx;
    a->y -= gap * f->ny;
}

/* Return the signed distance of a disc's centre from the start of a face, measured along the face. */
static inline double coordinate_along_face(const State *s, Index i, Index k) {
    const Disc *a = &s->discs[i];
    const Feature *f = &s->features[k];
    const Ground *g = &s->accelerated.grounds[k];
    return (a->x - g->x) * f->ny - (a->y - g->y) * f->nx;
}

/* Return how many seconds a disc that slides or rolls on a face takes to reach an end of the face. If the disc never
   reaches an end, or if its ground is a half-plane, return infinity. */
static inline double time_to_face_end(const State *s, Index i, Index k, double speed, double rate) {
    const Feature *f = &s->features[k];
    if (f->kind != FACE) {
        return CAROM_INF;
    }
    double place = coordinate_along_face(s, i, k), ahead = f->size.high - place;
    double back = speed < 0.0 || rate < 0.0
                      ? descent_time((DoubleDouble){place, 0.0}, (DoubleDouble){speed, 0.0}, (DoubleDouble){rate, 0.0})
                      : CAROM_INF;
    double forth = speed > 0.0 || rate > 0.0 ? descent_time((DoubleDouble){ahead, 0.0}, (DoubleDouble){-speed, 0.0},
                                                            (DoubleDouble){-rate, 0.0})
                                             : CAROM_INF;
    return forth < back ? forth : back;
}

static inline Press pressing_on(const State *s, Index i, const Feature *ground) {
    const Accelerated *run = &s->accelerated;
    double along = wall_speed(run->gx, run->gy, ground->ny, -ground->nx).high;
    double normal = -wall_speed(run->gx, run->gy, ground->nx, ground->ny).high;
    double ratio = s->turning[i].inverse_inertia_ratio;
    double friction = s->wall_laws[ground->wall].wall_contact.friction;
    return (Press){normal, along, friction, ratio, ratio != 0.0 ? run->rolling_resistance : 0.0};
}

/* ---- modes ---- */

static inline Mode mode_of(double speed, double along, bool sticks, bool blocks) {
    if (sticks) {
        return speed != 0.0 || along != 0.0 ? ROLL : REST;
    }
    return blocks ? BLOCK : SLIDE;
}

/* Return the present motion of a disc as a row of recorded changes of mode. `before` is the disc's mode before the
   change. */
static inline ModeRow mode_row(const State *s, Index i, Index wall, Mode before) {
    const Disc *a = &s->discs[i];
    const Parabola *p = &s->accelerated.paths[i];
    return (ModeRow){
        .disc = i,
        .wall = -1 - wall,
        .before = before,
        .after = p->mode,
        .position = {a->x, a->y},
        .velocity = {a->vx, a->vy},
        .acceleration = {p->ax, p->ay},
        .spin = s->turning[i].spin,
        .spin_rate = p->spin_rate,
    };
}

/* From the slip and rim speed of a disc, set its motion in contact with feature k: mode, accelerations, and when the
   motion ends. */
static inline ModeRow continue_in_contact(State *s, Index i, Index k, Slips now) {
    Disc *a = &s->discs[i];
    Parabola *p = &s->accelerated.paths[i];
    const Feature *f = &s->features[k];
    Mode before = p->mode;
    place_on_wall(s, i, k);
    Press press = pressing_on(s, i, f);
    double speed = a->vx * f->ny - a->vy * f->nx;
    bool resists = press.rolling_resistance > 0.0;
    /* a disc without slip rolls: the sum of its speed along the wall and its rim speed is 0, apart from rounding
       errors */
    if (resists && now.slip == 0.0) {
        speed = now.rim != 0.0 ? speed : 0.0;
        now.rim = 0.0 - speed;
    }
    ContactRates rates = contact_rates(&press, now);
    if (rates.sticks) {
        speed = press.inverse_inertia_ratio != 0.0 ? speed : 0.0;
        s->turning[i].spin = 0.0 - speed / a->radius;
    } else if (resists && now.rim == 0.0) {
        s->turning[i].spin = 0.0;
    }
    a->vx = speed * f->ny;
    a->vy = 0.0 - speed * f->nx;
    double ax = rates.along * f->ny, ay = 0.0 - rates.along * f->nx;
    if (p->left_ground != NO_OBSTACLE && is_same_instant(p->left, own_instant(a, p))) {
        const Feature *other = &s->features[p->left_ground];
        p->left_speed = greater(wall_speed(a->vx, a->vy, other->nx, other->ny).high, 0.0);
    } else if (ax != p->ax || ay != p->ay) {
        p->left_ground = NO_OBSTACLE;
    }
    p->ax = ax;
    p->ay = ay;
    p->spin_rate = rates.rim / a->radius;
    p->never_of = (int)k;
    p->never_met = NEVER_ALL;
    p->ground = (int)k;
    p->mode = mode_of(speed, rates.along, rates.sticks, rates.blocks);
    /* The speed and the spin of a rolling disc reach 0 at the same time. Without rolling resistance, the motion does
       not change when speed and spin reach 0. */
    double slip_wait = time_to_zero(now.slip, rates.along + rates.rim);
    double rim_wait = resists ? time_to_zero(now.rim, rates.rim) : CAROM_INF;
    double wait = rim_wait < slip_wait ? rim_wait : slip_wait;
    p->slip_ends = slip_wait == wait || (rates.sticks && resists);
    p->rim_ends = rim_wait == wait || (rates.sticks && resists);
    Instant own = own_instant(a, p);
    Instant zero = instant_after(own, wait);
    Instant over = instant_after(own, time_to_face_end(s, i, k, speed, rates.along));
    p->ends = earlier_of(zero, over);
    p->ends_at_face_end = is_before(over, zero);
    return mode_row(s, i, f->wall, before);
}

/* Begin the contact of a disc with feature k at the present instant. `approach` is the speed at which the disc
   approaches the feature. If `approach` is not 0, infinitely many bounces would follow, which are too short for the
   clock. Only the effect of the bounces on slip and spin is computed. */
static inline ModeRow land(State *s, Index i, Index k, double approach) {
    Disc *a = &s->discs[i];
    Parabola *p = &s->accelerated.paths[i];
    const Feature *f = &s->features[k];
    const Law *law = &s->wall_laws[f->wall];
    double restitution = law->wall_restitution;
    Press press = pressing_on(s, i, f);
    Slips now = {slip_on(s, i, f), rim_speed(s, i)};
    bool sticks = p->sticks && a->last < 0 && a->last != NO_BODY && s->features[-1 - a->last].wall == f->wall;
    /* If friction stopped the slip in the last bounce, the slip is 0, unless the tangential restitution has reversed
       the slip. A slip that is not 0 changes in the remaining bounces: see `slip_after_bounces`. */
    sticks = sticks && law->wall_contact.restitution == 0.0;
    /* If the remaining bounces stop the slip, the impulse of their friction is applied below. If the remaining bounces
       only reduce the slip, nothing is applied, because friction in contact has the same effect during the time of
       these bounces. */
    double by = 0.0;
    if (press.rolling_resistance != 0.0 && approach > 0.0 && restitution < 1.0) {
        double speed = now.slip - now.rim;
        Slips start = {sticks ? 0.0 : now.slip, now.rim};
        Slips left = both_after_bounces(&press, start, approach, restitution);
        if (left.slip == 0.0) {
            by = speed + left.rim;
            now = (Slips){0.0, left.rim};
        } else if (left.rim == 0.0) {
            now = (Slips){speed, 0.0};
        }
    } else if (sticks) { /* friction has stopped the slip, so a slip that is not 0 is a rounding error */
        now.slip = 0.0;
    } else if (approach > 0.0 && restitution < 1.0 &&
               slip_after_bounces(&press, now.slip, approach, restitution) == 0.0) {
        by = now.slip / (1.0 + press.inverse_inertia_ratio);
        now.slip = 0.0;
    }
    if (by != 0.0) { /* apply the impulse of friction; the normal speed does not change */
        a->vx -= by * f->ny;
        a->vy += by * f->nx;
    }
    a->last = NO_BODY;
    if (p->left_ground != NO_OBSTACLE && p->corner == -1 - k && is_same_instant(p->left, own_instant(a, p))) {
        /* an impact on another ground has lifted the disc off its ground, and the disc is now in contact with that
           other ground. So `corner` and `corner_ground` are exchanged */
        p->corner = -1 - p->corner_ground;
        p->corner_ground = (int)k;
    } else if (p->corner_ground != k) {
        p->corner = NO_BODY;
    }
    return continue_in_contact(s, i, k, now);
}

static inline ModeRow take_off(State *s, Index i) {
    Parabola *p = &s->accelerated.paths[i];
    Mode before = p->mode;
    Index wall = s->features[p->ground].wall;
    p->ground = p->left_ground = NO_OBSTACLE;
    p->corner = NO_BODY;
    p->mode = FLIGHT;
    p->ends = NEVER;
    p->ax = s->accelerated.gx;
    p->ay = s->accelerated.gy;
    p->spin_rate = 0.0;
    return mode_row(s, i, wall, before);
}

/* Make a disc at an end of its face fly off. If the disc is too slow to fly off, return false, because PIC does not
   solve the disc's motion around the end.

   At first, a disc that flies off touches the vertex at the end of the face. On its new path, the disc does not hit the
   face again. */
static inline bool leave_at_face_end(State *s, Index i, ModeRow *row) {
    Disc *a = &s->discs[i];
    Parabola *p = &s->accelerated.paths[i];
    const Index k = p->ground;
    const Feature *f = &s->features[k];
    bool at_last = 2.0 * coordinate_along_face(s, i, k) > f->size.high;
    double away = a->radius + f->half_width;
    a->x = (at_last ? f->fx.high : f->x.high) + away * f->nx;
    a->y = (at_last ? f->fy.high : f->y.high) + away * f->ny;
    int vertex = s->accelerated.grounds[k].over[at_last];
    if (vertex == NO_OBSTACLE) {
        return false;
    }
    /* The disc flies off if u^2 >= P (R + h), where u is its speed, P the gravity into the wall, R its radius and h the
       half width of the wall. A slower disc would hit the vertex at once. `arc_fall_time` tests the condition, because
       the same function predicts impacts with the vertex. So the take-off and later impacts are decided with the same
       rounded numbers. */
    Mover disc = mover_of(a);
    if (!(arc_fall_time(&s->accelerated.exact, &disc, &s->features[vertex], s->accelerated.gx, s->accelerated.gy, true,
                        0.0) > 0.0)) {
        return false;
    }
    *row = take_off(s, i);
    a->last = -1 - vertex;
    p->leaving = 0.0;
    p->never_of = (int)k;
    p->never_met = NEVER_FLAT;
    p->never_but = vertex;
    return true;
}

/* Continue the motion of a disc whose mode ends now because its slip or spin is 0, or because the disc is at an end of
   its face. Return false if the disc is at an end and too slow to fly off. */
static inline bool begin_next_mode(State *s, Index i, ModeRow *row) {
    Parabola *p = &s->accelerated.paths[i];
    const Index k = p->ground;
    s->discs[i].last = NO_BODY; /* on its new path, the disc may hit again the body that it hit last */
    if (p->ends_at_face_end) {
        return leave_at_face_end(s, i, row);
    }
    Slips now = {
        p->slip_ends ? 0.0 : slip_on(s, i, &s->features[k]),
        p->rim_ends ? 0.0 : rim_speed(s, i),
    };
    *row = continue_in_contact(s, i, k, now);
    return true;
}

/* Return a bound of the rounding error of the normal at which a disc touches a body, in radians. For a straight
   feature, whose normal is exact, return 0. */
static inline double normal_resolution(const State *s, Index i, Index body) {
    const Disc *a = &s->discs[i];
    double size = size_of(a->x, a->y, a->radius);
    if (body >= 0) {
        const Disc *b = &s->discs[body];
        return gap_resolution(size + size_of(b->x, b->y, b->radius)) / (a->radius + b->radius);
    }
    const Feature *f = &s->features[-1 - body];
    if (f->kind <= FACE) {
        return 0.0;
    }
    double sizes = size + size_of(f->x.high, f->y.high, f->size.high + f->half_width);
    Mover disc = mover_of(a);
    return gap_resolution(sizes) / fabs(reach_of(&disc, f).high);
}

static inline bool never_moves(const State *s, Index body) {
    return body < 0 ? !is_driven_wall(&s->driving, (Index)s->features[-1 - body].wall)
                    : s->discs[body].inverse_mass == 0.0 && driven_row(&s->driving, body) == NULL;
}

/* If disc `i` is in contact with a ground and has just hit another body, decide whether the disc stays in contact or
   leaves the ground. `struck` is the number of the other body: j for disc j, -1 - k for feature k. Return whether the
   disc's mode or accelerations change.

   A speed is low if a hop (a short flight above the ground) at this speed is lower than the resolution of the gap. The
   disc stays in contact if its speed along the ground's normal is low, and either points into the ground or is
   explained by the rounding error of the impact's normal. A disc that does not stay in contact begins a flight: it
   hops, or it hits the ground at once. If the other body is a wall perpendicular to the ground, only friction can make
   the disc hop. */
static inline bool update_contact_after_impact(State *s, Index i, Index struck, const double normal[2], ModeRow *row) {
    Parabola *p = &s->accelerated.paths[i];
    const Index k = p->ground;
    p->never_met = NEVER_NOTHING;
    p->left_ground = NO_OBSTACLE;
    if (struck != -1 - p->corner_ground) {
        p->corner = NO_BODY;
    }
    if (k == NO_OBSTACLE) {
        return false;
    }
    const Feature *f = &s->features[k];
    double approach = ground_approach(s, i, f);
    bool is_flat = struck < 0 && s->features[-1 - struck].kind <= FACE;
    bool is_fixed = never_moves(s, struck), hops = false;
    bool is_low = approach * approach <= 2.0 * pressing_on(s, i, f).normal * ground_gap_resolution(s, i, k);
    if (is_low || is_flat || is_fixed) {
        double part = fabs(normal[0] * f->nx + normal[1] * f->ny);
        hops = approach < 0.0 && ((struck < 0 && p->rubs) || part > normal_resolution(s, i, struck));
    }
    Parabola before = *p;
    bool stays = is_low && !hops;
    if (stays) {
        *row = continue_in_contact(s, i, k, (Slips){slip_on(s, i, f), rim_speed(s, i)});
    } else {
        place_on_wall(s, i, k);
        *row = take_off(s, i);
    }
    /* The instants at which the disc returns to its ground, or to a convex body at rest, are computed from the instant
       `left` and not from a rounded gap. */
    p->left = own_instant(&s->discs[i], p);
    if (hops) {
        p->left_ground = (int)k;
        p->left_speed = -approach;
    }
    bool is_inside = struck < 0 && s->features[-1 - struck].kind == INNER_ARC;
    if (is_fixed && !is_inside && (hops || (stays && p->leaving > 0.0))) {
        p->corner = (int)struck;
        p->corner_ground = (int)k;
        p->corner_way = 0.0;
    }
    return !stays || before.mode != p->mode || before.ax != p->ax || before.ay != p->ay ||
           before.spin_rate != p->spin_rate;
}

/* ---- recorded changes of mode ---- */

/* Reserve memory for the changes of mode in one event: at most one for each of two discs. Return whether there is
   enough memory. */
static inline bool reserve_modes(State *s) {
    Accelerated *run = &s->accelerated;
    if (run->mode_count + 2 > run->mode_capacity) {
        Index capacity = 2 * run->mode_capacity + 64;
        size_t used = (size_t)run->mode_count * sizeof(ModeRow);
        ModeRow *modes = s->resize(run->modes, used, (size_t)capacity * sizeof(ModeRow));
        if (modes == NULL) {
            return false;
        }
        run->modes = modes;
        run->mode_capacity = capacity;
    }
    return true;
}

/* Record a change of mode at the reported time, if impacts at that time are recorded. */
static inline void record_mode(State *s, const ModeRow *row) {
    Accelerated *run = &s->accelerated;
    if (is_recorded(&s->record, s->clock.reported)) {
        run->modes[run->mode_count] = *row;
        run->modes[run->mode_count].time = s->clock.reported;
        run->modes[run->mode_count].impacts = s->record.released + s->record.count;
        run->mode_count += 1;
    }
}
