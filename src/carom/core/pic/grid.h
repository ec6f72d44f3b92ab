/* Broad phase: a grid of square cells, in which a search (a scan) finds the discs near a given disc.

   A cell is wider than the largest sum of two radii, so discs whose cells are not neighbours do not touch. The
   outermost cells extend outwards without limit, so every disc is in a cell. A ring of empty cells around the grid
   makes special cases at its border unnecessary. Cells decide when two discs are checked, and never change a result. */

#pragma once

#include "carom/core/pic/parabola_motion.h"

/* ---- choice of the cells ---- */

/* Set the largest radius, the largest sum of two radii, and the factor for the width of a cell. For a single disc, the
   largest sum of two radii is twice its radius. */
static inline void set_sizes(Grid *g, const double *radius, Index discs, double factor) {
    double second = 0.0;
    g->radius = 0.0;
    for (Index i = 0; i < discs; i++) {
        second = greater(second, lesser(g->radius, radius[i]));
        g->radius = greater(g->radius, radius[i]);
    }
    g->reach = g->radius + (discs > 1 ? second : g->radius);
    g->factor = factor;
}

static inline void extend_box(Box *box, double x, double y) {
    box->left = lesser(box->left, x);
    box->right = greater(box->right, x);
    box->low = lesser(box->low, y);
    box->high = greater(box->high, y);
}

static inline Box box_around(const double *position, Index discs) {
    Box box = {position[0], position[0], position[1], position[1]};
    for (Index i = 1; i < discs; i++)
        extend_box(&box, position[2 * i], position[2 * i + 1]);
    return box;
}

/* Return an upper bound of the absolute values of all coordinates of a feature. For a half-plane, whose line is
   infinite, return the distance of this line from the origin. */
static inline double feature_extent(const Feature *f) {
    if (f->kind == PLANE)
        return fabs(f->x.high * f->nx + f->y.high * f->ny);
    /* A point of a face is no farther from the face's start than its length. A point of an arc is no farther from the
       centre than the radius. */
    return greater(fabs(f->x.high), fabs(f->y.high)) + f->size.high + f->half_width;
}

/* Return the distance of a wall's line from the origin. */
static inline double wall_extent(const Wall *w) {
    return fabs(w->x * w->nx + w->y * w->ny);
}

/* Choose the cells for discs that move in a box. If `factor` is infinite, choose a single cell.

   The width of a cell includes the rounding errors of coordinates in the box and of coordinates up to `Grid.extent`,
   because a disc may come back from an obstacle outside the box. */
static inline void choose_grid(Grid *g, const Box *box, Index discs, Index feature_count) {
    double width = box->right - box->left;
    double height = box->high - box->low;
    double cells = CAROM_CELLS_PER_DISC * (double)discs + CAROM_CELLS_PER_FEATURE * (double)feature_count;
    double most = lesser(cells, MOST_COLUMNS);
    double largest = greater(greater(fabs(box->left), fabs(box->right)), greater(fabs(box->low), fabs(box->high)));
    largest = greater(largest, g->extent);
    double cell = (g->reach * (1.0 + CAROM_CELL_MARGIN) + largest * CAROM_COORDINATE_ERROR) * g->factor;
    cell = greater(cell, sqrt(width / cells * height));
    cell = greater(cell, greater(width / most, height / most));
    g->x0 = box->left;
    g->y0 = box->low;
    g->width = g->reach;
    g->columns = g->rows = 1;
    if (cell < CAROM_INF) {
        g->width = cell;
        g->columns = (Index)greater(1.0, width / cell);
        g->rows = (Index)greater(1.0, height / cell);
    }
    g->stride = g->columns + 2;
    /* if the obstacles are features, a tile is a single cell, because a feature costs more to check than a
       half-plane */
    g->tile_bits = feature_count == 0;
    g->tiles = (g->columns >> g->tile_bits) + 1;
}

static inline Index cell_count(const Grid *g) {
    return g->stride * (g->rows + 2);
}

static inline Index tile_count(const Grid *g) {
    return g->tiles * ((g->rows >> g->tile_bits) + 1);
}

/* Return the number of the tile (block of cells) that contains a cell. Row 0 and column 0 are in the ring of empty
   cells around the grid. */
static inline Index tile_of(const Grid *g, Index row, Index column) {
    return (row >> g->tile_bits) * g->tiles + (column >> g->tile_bits);
}

/* ---- discs in cells ---- */

static inline void add_to_cell(State *s, Index i, Index row, Index column) {
    Cell *cell = &s->grid.cells[row * s->grid.stride + column];
    Index used = 0;
    s->predictions[i].cell = (int)(row << COLUMN_BITS | column);
    for (Index k = 0; k < PLACES; k++)
        used += cell->disc[k] != NOBODY;
    if (CAROM_LIKELY(used < PLACES)) {
        cell->disc[used] = (int)i;
        return;
    }
    Index head = cell->disc[PLACES - 1];
    if (head > NOBODY) /* the disc in the last place becomes the end of a new chain (list of further discs) */
        s->grid.chain[head] = NOBODY;
    else
        head = CHAINED - head;
    s->grid.chain[i] = (int)head;
    cell->disc[PLACES - 1] = (int)(CHAINED - i);
}

static inline void remove_from_cell(State *s, Index i, Index row, Index column) {
    Cell *cell = &s->grid.cells[row * s->grid.stride + column];
    int *chain = s->grid.chain;
    Index place = 0;
    Index used = 0;
    for (Index k = 0; k < PLACES; k++) {
        place += k * (Index)(cell->disc[k] == i);
        used += cell->disc[k] != NOBODY;
    }
    if (CAROM_LIKELY(cell->disc[PLACES - 1] >= NOBODY)) {
        cell->disc[place] = cell->disc[used - 1];
        cell->disc[used - 1] = NOBODY;
        return;
    }
    Index head = CHAINED - cell->disc[PLACES - 1];
    if (cell->disc[place] == i) { /* the first disc of the chain moves to the place of disc i */
        cell->disc[place] = (int)head;
        head = chain[head];
    } else if (head == i) {
        head = chain[i];
    } else {
        Index before = head;
        while (chain[before] != i)
            before = chain[before];
        chain[before] = chain[i];
    }
    cell->disc[PLACES - 1] = head != NOBODY ? (int)(CHAINED - head) : NOBODY;
}

static inline void remove_disc(State *s, Index i) {
    Index cell = s->predictions[i].cell;
    remove_from_cell(s, i, cell >> COLUMN_BITS, cell & COLUMN_MASK);
}

/* Return the number of the row or column that contains the coordinate `place`, which is given in widths of a cell. The
   result is from 0 to `count` - 1, and 0 for NaN. */
static inline Index clamp_to_cells(double place, Index count) {
    if (!(place > 0.0))
        return 0;
    return place < (double)count ? (Index)place : count - 1;
}

/* Put every disc, except driven discs, into the cell that contains it now. */
static inline void fill_cells(State *s) {
    Grid *g = &s->grid;
    for (Index i = 0; i < cell_count(g); i++) {
        for (Index k = 0; k < PLACES; k++)
            g->cells[i].disc[k] = NOBODY;
    }
    for (Index i = 0; i < s->disc_count; i++) {
        Motion centre = disc_motion(s, i, now_instant(s));
        if (CAROM_UNLIKELY(s->accelerated.paths != NULL))
            s->accelerated.paths[i].entered = s->clock.now;
        double column = (centre.x - g->x0) / g->width;
        double row = (centre.y - g->y0) / g->width;
        add_to_cell(s, i, 1 + clamp_to_cells(row, g->rows), 1 + clamp_to_cells(column, g->columns));
    }
    for (Index k = 0; k < s->driving.count; k++) {
        if (s->driving.rows[k].body >= 0)
            remove_disc(s, s->driving.rows[k].body);
    }
}

/* Return the mean number of discs that are in the same cell as a disc, including the disc itself. */
static inline double mean_occupancy(const State *s) {
    double pairs = 0.0;
    for (Index i = 0; i < cell_count(&s->grid); i++) {
        const Cell *cell = &s->grid.cells[i];
        Index count = 0;
        for (Index k = 0; k < PLACES; k++)
            count += cell->disc[k] > NOBODY;
        Index chained = cell->disc[PLACES - 1] < NOBODY ? CHAINED - cell->disc[PLACES - 1] : NOBODY;
        while (chained != NOBODY) {
            count += 1;
            chained = s->grid.chain[chained];
        }
        pairs += (double)(count * count);
    }
    return pairs / (double)s->disc_count;
}

static inline void cross_edge(State *s, Index i) {
    Index cell = s->predictions[i].cell;
    Index edge = s->predictions[i].edge;
    Index row = cell >> COLUMN_BITS;
    Index column = cell & COLUMN_MASK;
    remove_disc(s, i);
    row += (Index)(edge == UP) - (Index)(edge == DOWN);
    column += (Index)(edge == RIGHT) - (Index)(edge == LEFT);
    if (CAROM_UNLIKELY(s->accelerated.paths != NULL))
        s->accelerated.paths[i].entered = s->predictions[i].exit_time;
    add_to_cell(s, i, row, column);
}

/* Return the cell of disc `i` and the eight cells around it. */
static inline Block cells_around(const State *s, Index i) {
    Index cell = s->predictions[i].cell;
    Index row = cell >> COLUMN_BITS;
    Index column = cell & COLUMN_MASK;
    return (Block){(row - 1) * s->grid.stride + column - 1, 3, s->grid.stride, 1};
}

/* Return the three cells that became neighbours of disc `i` when it crossed an edge. */
static inline Block new_neighbours(const State *s, Index i) {
    Index cell = s->predictions[i].cell;
    Index edge = s->predictions[i].edge;
    Index across = (Index)(edge == RIGHT) - (Index)(edge == LEFT);
    Index along = (Index)(edge == UP) - (Index)(edge == DOWN);
    /* The three cells are one cell farther in the direction of the crossing, in a line perpendicular to this
       direction. */
    Index row = (cell >> COLUMN_BITS) + along - across * across;
    Index column = (cell & COLUMN_MASK) + across - along * along;
    return (Block){row * s->grid.stride + column, 1, 0, along == 0 ? s->grid.stride : 1};
}
