/* Contacts that begin at the start of a run, and motions that end without an impact. */

#pragma once

#include "carom/core/pic/parabola_impact.h"

/* ---- the end of a motion ---- */

/* Continue the motion of a disc whose mode of contact has ended, or that has stopped on a table. If the disc is at the
   end of a face and too slow to fly off, set `State.stopped` and return false, because PIC cannot continue. */
static inline bool apply_motion_end(State *s, Index i, Instant at) {
    ModeRow row;
    set_instant(s, at);
    move_on_parabola(s, i, now_instant(s));
    if (s->accelerated.deceleration > 0.0) {
        s->discs[i].last = NO_BODY; /* the disc rests here, and its new path begins here */
        change_motion(s, i);
        return true;
    }
    int ground = s->accelerated.paths[i].ground;
    if (!begin_next_mode(s, i, &row)) {
        s->accelerated.end = (ContactEnd){i, -1 - (Index)s->features[ground].wall, ground, ground, false};
        s->stopped = EDGE;
        return false;
    }
    change_motion(s, i);
    record_mode(s, &row);
    return true;
}

/* ---- the start ---- */

/* At the start of the run, begin contacts of discs with half-planes and faces. A contact begins if the gap is within
   its resolution and gravity presses the disc against the surface. Return false if there is not enough memory to record
   the contacts. */
static inline bool begin_contacts(State *s) {
    s->counts.has_begun = true;
    for (Index i = 0; i < s->disc_count; i++) {
        const Disc *a = &s->discs[i];
        Parabola *p = &s->accelerated.paths[i];
        for (Index k = 0; k < s->feature_count && a->inverse_mass > 0.0 && p->ground == NO_OBSTACLE; k++) {
            const Feature *f = &s->features[k];
            if (!s->accelerated.grounds[k].is_ground) {
                continue;
            }
            Mover disc = mover_of(a);
            if (f->kind == FACE && !foot_is_on_face(&disc, f, 0.0, s->accelerated.gx, s->accelerated.gy)) {
                continue;
            }
            double pull = -pressing_on(s, i, f).normal, resolution = ground_gap_resolution(s, i, k);
            double approach = ground_approach(s, i, f), gap = ground_gap(s, i, k);
            /* If the gap is below -radius, the disc's centre is behind the face, so the disc is on the other side of
               the edge. */
            bool is_slow = approach * approach <= -2.0 * pull * resolution;
            if (-a->radius < gap && gap <= resolution && pull < 0.0 && is_slow) {
                ModeRow row = land(s, i, k, approach);
                if (!reserve_modes(s)) {
                    return false;
                }
                record_mode(s, &row);
            }
        }
    }
    return true;
}
