/* Frame-sampled loop (PIT): Algorithm 1 of the source paper for any number of discs.

   A disc is due at a frame at which it may have an impact. The loop skips frames at which no disc is due. At other
   frames, the loop makes only the tests that can find an impact. If skipping costs more work than it saves, the loop
   makes all tests of a frame. With few discs, all tests are made for all pairs. With many discs, a sweep finds the
   overlapping discs. The loop tests all pairs at every frame if the caller requests this. */

#include <string.h>

#include "carom/core/pit/frame.h"
#include "carom/core/pit/set_up.h"
#include "carom/core/pit/sweep.h"

size_t carom_pit_set_up(State *s, const RunInput *input) {
    memset(s, 0, sizeof(State));
    if (input->disc_count + input->wall_count > INT32_MAX)
        return 0;
    s->disc_count = input->disc_count;
    s->wall_count = input->wall_count;
    s->path_count = count_paths(input);
    s->clock.step = input->step;
    s->clock.rate = input->rate;
    s->law = input->law;
    s->gx = input->gravity[0];
    s->gy = input->gravity[1];
    s->rolling_resistance = input->rolling_resistance;
    s->deceleration = input->deceleration;
    s->damping.rate = input->damping;
    s->motion = s->deceleration > 0.0 ? SLOWING : s->gx != 0.0 || s->gy != 0.0 ? FALLING : STRAIGHT;
    s->skips = input->skips;
    s->max_waste = input->max_waste;
    s->record.has_spins = input->has_spins;
    s->record.has_contacts = input->has_finite_walls;
    s->record.resize = input->resize;
    s->grid.list_count = count_lists(s);
    return lay_out(s, input, NULL);
}

void carom_pit_begin(State *s, const RunInput *input, void *memory) {
    memset(memory, 0, lay_out(s, input, memory));
    fill_discs(s, input);
    fill_paths(s, input);
    fill_walls(s, input);
    begin_bounds(s);
    for (Index i = 0; i < s->disc_count; i++) {
        s->due[i] = s->discs[i].inverse_mass == 0.0 && disc_path(s, i) == NULL ? CAROM_INF : 0.0;
        if (s->motion == SLOWING) {
            s->slowing[i].stops = NEVER;
            slow_disc(s, i);
        }
    }
    for (Index k = 0; k < s->grid.list_count; k++)
        s->grid.first[k] = NOBODY;
    if (CAROM_SKIPS && s->grid.list_count > 0)
        choose_levels(s);
}

void carom_pit_run(State *s, Index until, Index most) {
    while (s->counts.frames < until && s->work > 0.0 && !s->is_out_of_memory && !s->is_too_far) {
        if (s->row > 0)
            test_all(s);
        else if (s->record.released + s->record.count >= most)
            return;
        else if (loops_plainly(s) && (!CAROM_SKIPS || s->grid.list_count == 0))
            test_all(s);
        else if (loops_plainly(s))
            sweep_frame(s);
        else if (!skip_frames(s, until))
            test_due(s);
    }
}

void carom_pit_write_states(const State *s, double time, double *states) {
    double step = time - s->now;
    for (Index i = 0; i < s->disc_count; i++) {
        const Disc *a = &s->discs[i];
        const Path *path = disc_path(s, i);
        double *centre = &states[4 * i];
        double *velocity = centre + 2;
        centre[0] = a->x;
        centre[1] = a->y;
        velocity[0] = a->vx;
        velocity[1] = a->vy;
        if (path != NULL) {
            write_driven(path, &path->legs[leg_at(path, time, path->leg)], time, centre, velocity);
        } else if (s->motion == STRAIGHT) {
            centre[0] += a->vx * step;
            centre[1] += a->vy * step;
        } else if (step != 0.0 && a->inverse_mass != 0.0) {
            if (s->motion == FALLING) {
                advance_falling(s, centre, velocity, step);
            } else {
                Slowing slowing = s->slowing[i];
                advance_slowing(centre, velocity, &slowing, s->now, time);
            }
        }
    }
}
