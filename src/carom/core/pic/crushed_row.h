/* Crush of a row of discs between two bodies that impacts do not move: see crush.h. */

#pragma once

#include "carom/core/pic/crush_bodies.h"

/* ---- the row ---- */

typedef struct Struck { /* the body that a disc hit last on one side */
    int body;           /* number of the body; NO_BODY for none */
    int obstacle;
} Struck;

/* Return the body that a disc hit last on a given side. The unit vector (nx, ny) points from that side to the disc. */
static inline Struck struck_on_side(const ToAndFro *t, double nx, double ny) {
    if (nx == t->nx && ny == t->ny)
        return (Struck){t->last, t->last_obstacle};
    if (nx == -t->nx && ny == -t->ny)
        return (Struck){t->across, t->across_obstacle};
    return (Struck){NO_BODY, NO_OBSTACLE};
}

static inline bool is_moved_by_impacts(const State *s, Index body) {
    return body >= 0 && s->discs[body].inverse_mass > 0.0;
}

typedef struct RowSide { /* part of a row of discs on one side of a given disc */
    double nx;           /* unit vector from this part of the row to the given disc */
    double ny;
    Struck end;
    Index next_to_end; /* disc */
    Index count;       /* number of bodies on this side, including the body at the end */
} RowSide;

/* Find one side of a row: disc `i`, the disc that disc `i` hit last on this side, and so on, up to a body that impacts
   do not move. Return whether the row ends at a body that impacts do not move. */
static inline bool find_row_side(const State *s, Index i, double nx, double ny, RowSide *side) {
    *side = (RowSide){.nx = nx, .ny = ny};
    Index disc = i;
    while (side->count <= s->disc_count) {
        side->end = struck_on_side(&s->to_and_fro[disc], nx, ny);
        side->next_to_end = disc;
        side->count += 1;
        if (side->end.body == NO_BODY)
            return false;
        if (!is_moved_by_impacts(s, side->end.body))
            return true;
        disc = side->end.body;
    }
    return false; /* the discs hit each other in a circle, without a body at the end */
}

typedef struct Row { /* a row of discs: one disc, the discs on both sides of it, and the body at each end of the row */
    Index disc;
    RowSide side[2];
} Row;

/* Return the next disc of a row after a given disc, on one side. */
static inline Index next_in_row(const State *s, const RowSide *side, Index disc) {
    return struck_on_side(&s->to_and_fro[disc], side->nx, side->ny).body;
}

static inline bool is_in_row(const State *s, const void *bodies, Index body) {
    const Row *row = bodies;
    bool found = body == row->disc;
    for (int n = 0; n < 2 && !found; n++) {
        Index one = row->disc;
        for (Index k = 0; k < row->side[n].count && !found; k++) {
            one = next_in_row(s, &row->side[n], one);
            found = one == body;
        }
    }
    return found;
}

/* Return the component of a vector that is perpendicular to a normal. The normal must be parallel to an axis, and `nx`
   is its x component. */
static inline double component_across(double x, double y, double nx) {
    return nx != 0.0 ? y : x;
}

/* For a given time, find the velocity of the body at one end of a row, and the point at which the line of the row meets
   the body's surface. Return whether the rule for rows applies to this end of the row.

   A wall at the end must not move across the line of the row, and must be perpendicular to the line where they meet. */
static inline bool find_row_end(const State *s, const RowSide *side, double nx, double ny, double time, Motion *end) {
    Index body = side->end.body;
    if (body >= 0) {
        Motion there = disc_motion(s, body, (Instant){time, 0.0});
        double radius = s->discs[body].radius;
        *end = (Motion){there.x + radius * nx, there.y + radius * ny, there.vx, there.vy};
        return true;
    }
    const Leg *leg = legs_ahead(s, body, time).legs;
    if (component_across(leg->vx, leg->vy, nx) != 0.0)
        return false;
    Point moved = displacement_on(leg, time);
    const Feature *f = &s->features[side->end.obstacle];
    double depth = 0.0;
    bool fits;
    if (f->kind == PLANE) {
        fits = component_across(f->nx, f->ny, nx) == 0.0;
    } else if (f->kind == FACE) {
        depth = f->half_width;
        fits = f->nx == nx && f->ny == ny &&
               component_across(f->fy.high - f->y.high, -(f->fx.high - f->x.high), nx) == 0.0;
    } else {
        depth = f->kind == INNER_ARC ? f->half_width - f->size.high : f->half_width + f->size.high;
        Motion seen = disc_motion(s, side->next_to_end, (Instant){time, 0.0});
        fits = component_across(seen.x - moved.x - f->x.high, seen.y - moved.y - f->y.high, nx) == 0.0;
    }
    *end = (Motion){f->x.high + moved.x + depth * nx, f->y.high + moved.y + depth * ny, leg->vx, leg->vy};
    return fits;
}

/* Return whether the centres of all discs of a row are on one line at a given time, and no disc moves across the line.
   Discs at the ends of the row are included. */
static inline bool is_on_line(const State *s, const Row *row, double nx, double time) {
    Motion from = disc_motion(s, row->disc, (Instant){time, 0.0});
    if (component_across(from.vx, from.vy, nx) != 0.0)
        return false;
    for (int n = 0; n < 2; n++) {
        Index disc = row->disc;
        for (Index k = 0; k < row->side[n].count; k++) {
            disc = next_in_row(s, &row->side[n], disc);
            if (disc < 0)
                break;
            Motion there = disc_motion(s, disc, (Instant){time, 0.0});
            if (component_across(there.x, there.y, nx) != component_across(from.x, from.y, nx) ||
                component_across(there.vx, there.vy, nx) != 0.0)
                return false;
        }
    }
    return true;
}

/* Return whether friction acts in the impacts of a row, because a disc spins or the surface of a wall moves. Friction
   would move the discs off the line. */
static inline bool row_slips(const State *s, const Row *row) {
    bool rubs = false, slips = stored_spin(s, row->disc) != 0.0;
    for (int n = 0; n < 2; n++) {
        const RowSide *side = &row->side[n];
        Index body = row->disc;
        for (Index k = 0; k < side->count; k++) {
            body = next_in_row(s, side, body);
            rubs = rubs || (body < 0 ? rubs_on(s, -1 - body) : s->law.contact.friction > 0.0);
            slips = slips || (body < 0 ? belt_of(s, -1 - body) != 0.0 : stored_spin(s, body) != 0.0);
        }
    }
    return rubs && slips;
}

/* Return the sum of the diameters of a row's discs. The sum has more digits than a float, so the order of the discs
   does not matter. */
static inline double row_length(const State *s, const Row *row) {
    DoubleDouble sum = {2.0 * s->discs[row->disc].radius, 0.0};
    for (int n = 0; n < 2; n++) {
        Index disc = row->disc;
        for (Index k = 1; k < row->side[n].count; k++) {
            disc = next_in_row(s, &row->side[n], disc);
            DoubleDouble next = two_sum(sum.high, 2.0 * s->discs[disc].radius);
            sum = two_sum(next.high, next.low + sum.low);
        }
    }
    return sum.high;
}

static inline bool is_row_disturbed(const State *s, const Row *row, double way, double seconds) {
    bool found = is_disturbed(s, row->disc, is_in_row, row, way, seconds);
    for (int n = 0; n < 2; n++) {
        Index disc = row->disc;
        for (Index k = 1; k < row->side[n].count && !found; k++) {
            disc = next_in_row(s, &row->side[n], disc);
            found = is_disturbed(s, disc, is_in_row, row, way, seconds);
        }
    }
    return found;
}

/* Return whether an impact on the body at an end of a row loses energy. If that body is a disc, return false. */
static inline bool end_loses(const State *s, const RowSide *side) {
    Index body = side->end.body;
    return body < 0 && s->wall_laws[-1 - body].wall_restitution < 1.0;
}

/* Return whether disc `i` is crushed between two bodies that impacts do not move, alone or in a row of discs. If the
   disc is crushed, set `crush`.

   All discs must be exactly on one line parallel to an axis, without velocity, acceleration or slip across the line, so
   that nothing moves them off the line. In a row of several discs, no impact may lose energy, because otherwise the
   discs could come to rest on each other instead of being crushed. */
static inline bool find_crush_in_row(const State *s, Index i, Crush *crush) {
    double nx = s->to_and_fro[i].nx, ny = s->to_and_fro[i].ny, now = s->discs[i].time;
    Row row = {.disc = i};
    if (!find_row_side(s, i, nx, ny, &row.side[0]) || !find_row_side(s, i, -nx, -ny, &row.side[1]))
        return false;
    if ((nx != 0.0 && ny != 0.0) || component_across(s->accelerated.gx, s->accelerated.gy, nx) != 0.0)
        return false;
    bool is_single = row.side[0].count + row.side[1].count == 2;
    bool loses = s->law.restitution < 1.0 || end_loses(s, &row.side[0]) || end_loses(s, &row.side[1]);
    if ((!is_single && loses) || !is_on_line(s, &row, nx, now) || row_slips(s, &row))
        return false;
    Motion from, to;
    if (!find_row_end(s, &row.side[0], nx, ny, now, &from) || !find_row_end(s, &row.side[1], -nx, -ny, now, &to))
        return false;
    double closing = (from.vx - to.vx) * nx + (from.vy - to.vy) * ny;
    double room = (to.x - from.x) * nx + (to.y - from.y) * ny;
    room = greater(0.0, room - row_length(s, &row));
    if (!(closing > 0.0))
        return false;
    double left = room / closing;
    double way = room + left * greater(nearest_length(from.vx, from.vy), nearest_length(to.vx, to.vy));
    for (int n = 0; n < 2; n++) {
        if (legs_ahead(s, row.side[n].end.body, now).legs->end <= now + left)
            return false;
    }
    if (is_row_disturbed(s, &row, way, left))
        return false;
    *crush = (Crush){i, {row.side[0].end.body, row.side[1].end.body}, now + left};
    return true;
}
