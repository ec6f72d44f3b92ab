/* Set-up of a run of PIT: memory layout, and functions that fill the memory from a `RunInput`. */

#pragma once

#include "carom/core/impact_record.h"
#include "carom/core/pit/state.h"

/* ---- sizes ---- */

/* If `is_disc` is true, return whether any driven body is a disc. If `is_disc` is false, return whether any driven body
   is a wall. */
static inline bool is_some_driven(const RunInput *input, bool is_disc) {
    for (Index k = 0; k < input->driven_count; k++) {
        if ((input->driven[DRIVEN_NUMBERS * k] >= 0.0) == is_disc)
            return true;
    }
    return false;
}

/* Return the number of driven bodies that have a path. A driven body without a path is a wall that stays in place while
   its surface moves. */
static inline Index count_paths(const RunInput *input) {
    Index count = 0;
    for (Index k = 0; k < input->driven_count; k++)
        count += input->driven[DRIVEN_NUMBERS * k + 1] > 0.0;
    return count;
}

/* Set the addresses of all arrays of a run in the block `memory`, and return their total size in bytes. If `memory` is
   NULL, only the returned size is meaningful. */
static inline size_t lay_out(State *s, const RunInput *input, void *memory) {
    Arena arena = {memory, 0};
    Index discs = s->disc_count;
    Index walls = s->wall_count;
    bool has_chains = input->edge_count > 0;
    s->discs = RESERVE_ROWS(&arena, Disc, discs);
    s->walls = RESERVE_ROWS(&arena, Wall, walls);
    s->wall_laws = RESERVE_ROWS(&arena, Law, walls);
    s->chains = has_chains ? RESERVE_ROWS(&arena, Chain, walls) : NULL;
    s->edges = RESERVE_ROWS(&arena, ChainEdge, input->edge_count);
    s->hits = RESERVE_ROWS(&arena, ChainHit, has_chains ? discs : 0);
    s->stored = has_inelastic_body(input) ? RESERVE_ROWS(&arena, StoredImpacts, discs) : NULL;
    s->slowing = RESERVE_ROWS(&arena, Slowing, s->motion == SLOWING ? discs : 0);
    s->paths = RESERVE_ROWS(&arena, Path, s->path_count);
    s->legs = RESERVE_ROWS(&arena, Leg, input->leg_count);
    s->disc_paths = is_some_driven(input, true) ? RESERVE_ROWS(&arena, int, discs) : NULL;
    s->wall_motions = is_some_driven(input, false) ? RESERVE_ROWS(&arena, WallMotion, walls) : NULL;
    s->turning = RESERVE_ROWS(&arena, Turning, s->record.has_spins ? discs : 1);
    s->searches = RESERVE_ROWS(&arena, Search, discs);
    s->clearances = RESERVE_ROWS(&arena, Clearance, discs);
    s->stale_discs = RESERVE_ROWS(&arena, int, discs);
    s->due = RESERVE_ROWS(&arena, double, discs);
    s->due_discs = RESERVE_ROWS(&arena, int, discs + 1);
    s->grid.first = RESERVE_ROWS(&arena, int, s->grid.list_count);
    s->grid.swept = RESERVE_ROWS(&arena, int, s->grid.list_count);
    s->grid.swept_next = RESERVE_ROWS(&arena, int, s->grid.list_count > 0 ? discs : 0);
    s->record.recent = RESERVE_ROWS(&arena, Recent, discs);
    return arena.used;
}

/* ---- rows ---- */

/* Fill the rows of driven bodies, of the legs (straight parts) of their paths, and of the motions of walls and
   surfaces. */
static inline void fill_paths(State *s, const RunInput *input) {
    for (Index i = 0; i < s->disc_count && s->disc_paths != NULL; i++)
        s->disc_paths[i] = NO_PATH;
    for (Index k = 0; k < s->wall_count && s->wall_motions != NULL; k++)
        s->wall_motions[k].path = NO_PATH;
    Leg *leg = s->legs;
    int number = 0;
    for (Index k = 0; k < input->driven_count; k++) {
        const double *row = input->driven + DRIVEN_NUMBERS * k;
        Index body = (Index)row[0];
        if (body < 0)
            s->wall_motions[-1 - body].surface.belt = row[2];
        if (row[1] == 0.0)
            continue;
        Path *path = &s->paths[number];
        *path = (Path){.body = body, .legs = leg, .leg_count = (Index)row[1]};
        for (; leg < path->legs + path->leg_count; leg++) {
            *leg = leg_of(input, leg - s->legs);
            path->fastest = greater(path->fastest, sqrt(leg->vx * leg->vx + leg->vy * leg->vy));
        }
        if (body >= 0) {
            path->x = s->discs[body].x;
            path->y = s->discs[body].y;
            s->disc_paths[body] = number;
        } else {
            WallMotion *motion = &s->wall_motions[-1 - body];
            motion->path = number;
            motion->surface.vx = path->legs[0].vx;
            motion->surface.vy = path->legs[0].vy;
        }
        number += 1;
    }
}

static inline void fill_discs(State *s, const RunInput *input) {
    for (Index i = 0; i < s->disc_count; i++) {
        Disc *a = &s->discs[i];
        *a = (Disc){
            .x = input->position[2 * i],
            .y = input->position[2 * i + 1],
            .vx = input->velocity[2 * i],
            .vy = input->velocity[2 * i + 1],
            .radius = input->radius[i],
            .inverse_mass = 1.0 / input->mass[i],
            .next = NOBODY,
            .cell = NO_CELL,
            .last = NOBODY,
        };
        if (s->record.has_spins)
            s->turning[i] = (Turning){input->spin[i], 1.0 / input->inertia[i]};
        clear_recent(&s->record.recent[i]);
        s->clearances[i].gap = -CAROM_INF;
    }
}

static inline void fill_walls(State *s, const RunInput *input) {
    write_wall_laws(s->wall_laws, input);
    ChainEdge *edge = s->edges;
    const double *numbers = input->edges;
    for (Index k = 0; k < s->wall_count; k++) {
        const double *row = input->chains + CHAIN_NUMBERS * k;
        Index count = (Index)row[0];
        s->walls[k] = (Wall){row[3], row[4], row[5], row[6]};
        double size = count > 0 ? row[2] : fabs(row[3]) + fabs(row[4]);
        s->wall_size = greater(size, s->wall_size);
        if (s->chains != NULL)
            s->chains[k] = (Chain){edge, count, row[1], row[2]};
        for (Index n = 0; n < count; n++, edge++, numbers += EDGE_NUMBERS) {
            *edge = (ChainEdge){
                numbers[0], numbers[1], numbers[2], numbers[3], numbers[4], numbers[5], numbers[6], numbers[7],
                numbers[8] != 0.0, numbers[9] != 0.0,
            };
            enclose_edge(edge);
        }
    }
}
