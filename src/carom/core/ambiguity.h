/* Ambiguous impacts: those whose result depends on an order that physics does not decide.

   An impact is ambiguous where it shares a movable disc with an earlier recorded one at what may be the same instant, as
   far as resolution.h knows both. It is not where the two normals are exactly orthogonal, because then neither impulse
   changes the result of the other. The result of an ambiguous impact depends on an order that is a convention: (time,
   first, second). Friction also acts across the normal: an impact with friction has no direction (not a number), and is
   orthogonal to none. Faces of finite walls whose order changes nothing are in `carom.physics.wall_features`:
   `are_decidable`.

   Two earlier impacts of a disc are enough. No direction is orthogonal to two that are not parallel. Of all impacts that
   reach as far in time as a later one, the one that reaches furthest interferes with it. Otherwise the furthest of those
   not parallel to that one does, or none does. */

#pragma once

#include "carom/core/carom_core.h"
#include "carom/core/constants.h"

/* Return whether an impact not before `begin` may be simultaneous with an earlier one that changes its result. */
static inline bool has_influence(const LastContact *earlier, double begin, const LastContact *later,
                                 const Corners *corners) {
    if (!(begin <= earlier->latest && later->nx * earlier->nx + later->ny * earlier->ny != 0.0))
        return false;
    if (earlier->feature == NO_FEATURE || later->feature == NO_FEATURE)
        return true;
    return !corners->is_order_free(corners->context, earlier->feature, later->feature,
                                   earlier->elastic && later->elastic);
}

/* Add an impact to those of a disc; return whether it is ambiguous. */
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

/* Start with no earlier impacts. */
static inline void clear_recent(Recent *recent) {
    recent->furthest = (LastContact){-CAROM_INF, 0.0, 0.0, NO_FEATURE, false};
    recent->across = recent->furthest;
}
