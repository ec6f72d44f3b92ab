/* Recorded impacts: the uncertainty of their times, the test for ambiguous impacts, and the arrays of impacts. */

#pragma once

#include "carom/core/arithmetic/double_double.h"
#include "carom/core/carom_core.h"

/* ---- resolution ---- */

/* Resolution of an impact's time: the uncertainty that results from the rounding of positions and times.

   `carom.core.resolution` derives the error bound of a gap. The error bound of the gap divided by the speed of approach
   is an error bound of the time.

   In a grazing impact, the speed of approach can be arbitrarily small. Near a grazing impact, the gap is a parabola in
   time with the curvature u^2 / R, where u is the relative speed and R the sum of the radii. An error of the gap
   changes the instant of contact by at most sqrt(2 R error) / u, which is half the width of the parabola at a depth
   equal to the error. The quotient error / speed and this bound both limit the error of the time; the resolution is the
   smaller of them. */

/* Return whether two discs in contact are near enough to the origin. Farther out, their coordinates are too coarse to
   compute the normal of their impact. */
static inline bool are_distinguishable(double x1, double y1, double x2, double y2, double reach) {
    return fabs(x1) + fabs(y1) + fabs(x2) + fabs(y2) <= CAROM_FARTHEST * reach;
}

/* Return the sum of a body's radius and the absolute values of its coordinates. The coordinates of a wall are those of
   the point that defines its surface. */
static inline double size_of(double x, double y, double radius) {
    return fabs(x) + fabs(y) + radius;
}

/* Return the resolution of the gap between two bodies, in metres. `sizes` is the sum of `size_of` for both bodies. */
static inline double gap_resolution(double sizes) {
    return 5.0 * CAROM_ULP * sizes;
}

/* Return the resolution of an impact of two discs, in seconds. `sizes` is the sum of `size_of` for both discs. u is
   their relative velocity before the impact, and `speed` is its component along the normal. */
static inline double pair_resolution(double sizes, double reach, double ux, double uy, double speed) {
    double error = gap_resolution(sizes);
    /* Far from a graze, error / speed is at most half of the bound `graze` below, because error / speed <= 2^10 error /
       u and graze >= sqrt(2 * 2^22 error^2) / u. */
    if (CAROM_LIKELY(speed >= 0x1p-10 * (fabs(ux) + fabs(uy)) && error <= 0x1p-22 * reach && speed > 0.0))
        return error / speed;
    double fast = sqrt(ux * ux + uy * uy);
    double graze = fast > 0.0 ? reach * sqrt(2.0 * (error / reach)) / fast : CAROM_INF;
    return speed > 0.0 ? lesser(error / speed, graze) : graze;
}

/* Return the resolution of an impact on a wall, in seconds. */
static inline double wall_resolution(double sizes, double speed) {
    return speed > 0.0 ? gap_resolution(sizes) / speed : CAROM_INF;
}

/* Return the resolution of a time since the start, in seconds. The resolution includes the rounding of a root, and the
   rounding of the sum of a time and this root. */
static inline double clock_resolution(double time) {
    return 2.0 * CAROM_ULP * time;
}

/* ---- ambiguous impacts ---- */

/* Ambiguous impacts: their result depends on the order of simultaneous impacts, which physics does not decide.

   An impact is ambiguous if it may have the same instant as an earlier recorded impact of the same movable disc.
   Whether two impacts may have the same instant follows from the resolutions of their times. Two impacts with exactly
   orthogonal normals are not ambiguous, because neither impulse changes the result of the other impact. Friction also
   acts perpendicular to the normal. So the normal of an impact with friction is stored as NaN, which is not orthogonal
   to any normal. For some pairs of faces of finite walls, the order also has no effect: see `are_decidable` in
   `carom.core.wall_parts`.

   Two earlier impacts of each disc are sufficient to decide whether an impact is ambiguous. `Recent.furthest` is the
   impact whose interval of possible times ends last. A new impact is ambiguous if its interval begins before the
   interval of `furthest` ends, and the two normals are not orthogonal. If the two normals are orthogonal, only earlier
   impacts whose normals are not parallel to that of `furthest` matter. Among impacts whose normals are not parallel to
   that of `furthest`, `Recent.across` is the impact whose interval ends last. */

/* Return whether an earlier impact may be simultaneous with a later impact and change its result. `begin` is a lower
   bound of the later impact's time. */
static inline bool has_influence(const LastContact *earlier, double begin, const LastContact *later,
                                 const Corners *corners) {
    if (!(begin <= earlier->latest && later->nx * earlier->nx + later->ny * earlier->ny != 0.0))
        return false;
    if (earlier->feature == NO_FEATURE || later->feature == NO_FEATURE)
        return true;
    return !corners->is_order_free(corners->context, earlier->feature, later->feature,
                                   earlier->elastic && later->elastic);
}

/* Add an impact to the recent impacts of a disc. Return whether this impact is ambiguous. */
static inline bool add_contact(Recent *recent, double time, double resolution, double nx, double ny, int feature,
                               bool elastic, const Corners *corners) {
    LastContact *f = &recent->furthest;
    double begin = time - resolution;
    double latest = time + resolution;
    LastContact last = {latest, nx, ny, feature, elastic};
    bool found =
        has_influence(f, begin, &last, corners) || has_influence(&recent->across, begin, &last, corners);
    bool parallel = nx * f->ny == ny * f->nx;
    if (CAROM_LIKELY(latest > f->latest)) {
        if (CAROM_LIKELY(!parallel))
            recent->across = *f;
        recent->furthest = last;
    } else if (!parallel && latest > recent->across.latest) {
        recent->across = last;
    }
    return found;
}

/* Initialise the recent impacts of a disc that has not hit anything. */
static inline void clear_recent(Recent *recent) {
    recent->furthest = (LastContact){-CAROM_INF, 0.0, 0.0, NO_FEATURE, false};
    recent->across = recent->furthest;
}

/* ---- rows ---- */

static inline bool is_recorded(const Record *r, double time) {
    return r->is_wanted && r->begin <= time && time <= r->end;
}

/* Resize the arrays of recorded impacts to `capacity` rows. Return false if there is not enough memory. */
static inline bool resize_rows(Record *r, Index capacity) {
    if (r->has_spins) {
        Spins *spins = r->resize(r->spins, (size_t)r->count * sizeof(Spins), (size_t)capacity * sizeof(Spins));
        if (spins == NULL)
            return false;
        r->spins = spins;
    }
    if (r->has_contacts) {
        Contact *contacts =
            r->resize(r->contacts, (size_t)r->count * sizeof(Contact), (size_t)capacity * sizeof(Contact));
        if (contacts == NULL)
            return false;
        r->contacts = contacts;
    }
    Impact *rows = r->resize(r->rows, (size_t)r->count * sizeof(Impact), (size_t)capacity * sizeof(Impact));
    if (rows == NULL)
        return false;
    r->rows = rows;
    r->capacity = capacity;
    return true;
}

/* Reserve memory for the row of one more impact. Return false if there is not enough memory. */
static inline bool reserve_row(Record *r) {
    if (CAROM_UNLIKELY(r->count == r->capacity)) {
        Index capacity =
            r->capacity < (Index)1 << 22 ? 4 * r->capacity + 256 : r->capacity + r->capacity / 2;
        if (!resize_rows(r, capacity))
            return false;
    }
    if (CAROM_UNLIKELY(r->ambiguous_count == r->ambiguous_capacity)) {
        Index capacity = 2 * r->ambiguous_capacity + 64;
        int64_t *ambiguous = r->resize(r->ambiguous, (size_t)r->ambiguous_count * sizeof(int64_t),
                                       (size_t)capacity * sizeof(int64_t));
        if (ambiguous == NULL)
            return false;
        r->ambiguous = ambiguous;
        r->ambiguous_capacity = capacity;
    }
    return true;
}

/* Write the impact that was just applied as the next row. `reserve_row` must have reserved memory for the row. */
static inline void write_impact_row(Record *r, const Impact *impact, const Spins *spins, Contact contact) {
    r->rows[r->count] = *impact;
    if (r->has_spins)
        r->spins[r->count] = *spins;
    if (r->has_contacts)
        r->contacts[r->count] = contact;
    r->count += 1;
}

/* The data that decide whether an impact is ambiguous. */
typedef struct Ambiguity {
    double resolution; /* resolution of the impact's time, in seconds */
    bool slides;       /* whether friction acts between the bodies */
    bool moves1;       /* `moves1` and `moves2`: whether the first and the second body are movable discs */
    bool moves2;
    int feature; /* number of the hit feature, if it belongs to a finite wall; else NO_FEATURE */
    bool elastic; /* whether an impact on the wall of this feature loses no energy */
} Ambiguity;

/* Store an impact for comparison with later impacts. Return whether this impact is ambiguous. */
static inline bool note_impact(const Record *r, const Impact *impact, const Ambiguity *a) {
    double time = impact->time, nx = impact->normal[0], ny = impact->normal[1];
    int feature = a->feature;
    /* friction also acts along the tangent, so no other impact may count as orthogonal */
    if (CAROM_UNLIKELY(a->slides)) {
        nx = ny = NAN;
        feature = NO_FEATURE;
    }
    int64_t bodies[2] = {impact->first, impact->second};
    bool moves[2] = {a->moves1, a->moves2}, ambiguous = false;
    for (int k = 0; k < 2; k++) {
        Recent *recent = &r->recent[moves[k] ? bodies[k] : 0];
        if (moves[k] && add_contact(recent, time, a->resolution, nx, ny, feature, a->elastic, &r->corners))
            ambiguous = true;
    }
    return ambiguous;
}

/* Mark the impact that becomes the next row as ambiguous. */
static inline void mark_ambiguous(Record *r) {
    r->ambiguous[r->ambiguous_count] = r->released + r->count;
    r->ambiguous_count += 1;
}

/* Record an impact that was just applied, and mark it if it is ambiguous. */
static inline void record_impact(Record *r, const Impact *impact, const Spins *spins, Contact contact,
                                 const Ambiguity *a) {
    if (CAROM_UNLIKELY(note_impact(r, impact, a)))
        mark_ambiguous(r);
    write_impact_row(r, impact, spins, contact);
}
