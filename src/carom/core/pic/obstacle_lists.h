/* Lists of obstacles: for each cell, all obstacles that a disc in the cell may hit, and few others.

   A tile is a block of 2 by 2 cells, or one cell if the obstacles are features. Each tile has one list. To build the
   lists, the grid is halved recursively. Each half is compared only with the obstacles near the block that was halved,
   so that an obstacle causes work only for the tiles near it. All lists are in one array, and each tile has the index
   at which its list begins. Each list contains numbers in ascending order, and ends with NO_OBSTACLE. Tiles far from
   all obstacles share the first list in the array, which is empty.

   No disc can be in a tile (block of cells) that is completely behind a wall. A tile behind a wall has the list of all
   obstacles, which is correct for any disc. A tile at the border of the grid extends outwards without limit, but its
   list is valid only up to OUTWARD cell widths outside the grid. A disc farther outside is checked against all
   obstacles. */

#pragma once

#include <string.h>

#include "carom/core/pic/grid.h"

/* ---- tiles and an obstacle ---- */

typedef enum Side { /* position of a box (block of tiles) relative to an obstacle */
    CLEAR = 0,      /* the obstacle is so far from the box that no disc with its centre in the box touches it */
    NEARBY = 1,
    BEHIND = 2, /* the box is completely behind the wall, so no disc can be in the box */
} Side;

/* a block of tiles (blocks of cells); tiles at the border of the grid include the ring of empty cells */
typedef struct Tiles {
    Index left;
    Index right; /* number of the last column plus 1 */
    Index low;
    Index high;
} Tiles;

/* Return the coordinate at which row or column number `k` of the `count` rows or columns begins. The first row or
   column begins OUTWARD cell widths before the grid, and the last ends OUTWARD cell widths after the grid. */
static inline double line_between(double begin, double width, Index count, Index k) {
    if (k <= 1)
        return begin - OUTWARD * width;
    return begin + (double)(k <= count ? k - 1 : count + OUTWARD) * width;
}

static inline Box box_of(const Grid *g, const Tiles *tiles) {
    return (Box){
        line_between(g->x0, g->width, g->columns, tiles->left << g->tile_bits),
        line_between(g->x0, g->width, g->columns, tiles->right << g->tile_bits),
        line_between(g->y0, g->width, g->rows, tiles->low << g->tile_bits),
        line_between(g->y0, g->width, g->rows, tiles->high << g->tile_bits),
    };
}

/* Return the position of a box of tiles relative to a wall. The result is NEARBY if the distance between the box's
   middle and the wall is at most the largest radius plus half a diagonal of the box.

   Instead of half the diagonal, the code uses half the sum of the sides. For a tile of width w, half the sum is .29 w
   longer, which is more than the rounding errors of a path. */
static inline Side side_of_wall(const Grid *g, const Wall *wall, const Box *box) {
    double reach = g->radius + 0.5 * ((box->right - box->left) + (box->high - box->low));
    double dx = 0.5 * (box->left + box->right) - wall->x;
    double dy = 0.5 * (box->low + box->high) - wall->y;
    Bounded distance = approach(dx, dy, wall->nx, wall->ny);
    if (distance.value + distance.error < -reach)
        return BEHIND;
    return distance.value - distance.error >= reach ? CLEAR : NEARBY;
}

/* Return whether the point (x, y), relative to an arc's centre, is in the sector of the arc. If rounding errors make
   the answer uncertain, return true. */
static inline bool may_be_in_sector(const Feature *arc, double x, double y) {
    double open = 4.0 * CAROM_ERROR * arc->size.high * (fabs(x) + fabs(y));
    bool after_first = arc->ex.high * y - arc->ey.high * x >= -open;
    bool before_last = arc->fx.high * y - arc->fy.high * x <= open;
    return arc->whole || (arc->reflex ? after_first || before_last : after_first && before_last);
}

/* Return the distance of a point from a feature that is not a half-plane.

   The error bound is larger than the sum of all rounding errors, of which there are about twenty. Rounding may make it
   uncertain whether the point is in an arc's sector. In uncertain cases, the arc's circle and an end of the arc have
   nearly the same distance from the point, so either distance may be used. */
static inline Bounded distance_to(const Feature *f, double x, double y) {
    double dx = x - f->x.high;
    double dy = y - f->y.high;
    double lengths = fabs(x) + fabs(y) + fabs(f->x.high) + fabs(f->y.high) + f->size.high;
    Bounded found = {0.0, 4.0 * CAROM_ERROR * lengths};
    if (f->kind == VERTEX) {
        found.value = sqrt(dx * dx + dy * dy);
    } else if (f->kind == FACE) {
        double ex = f->ex.high;
        double ey = f->ey.high;
        double part = lesser(greater((dx * ex + dy * ey) / (ex * ex + ey * ey), 0.0), 1.0);
        dx -= part * ex;
        dy -= part * ey;
        found.value = sqrt(dx * dx + dy * dy);
    } else if (may_be_in_sector(f, dx, dy)) {
        found.value = fabs(sqrt(dx * dx + dy * dy) - f->size.high);
    } else {
        double to_first = (dx - f->ex.high) * (dx - f->ex.high) + (dy - f->ey.high) * (dy - f->ey.high);
        double to_last = (dx - f->fx.high) * (dx - f->fx.high) + (dy - f->fy.high) * (dy - f->fy.high);
        found.value = sqrt(lesser(to_first, to_last));
    }
    return found;
}

/* Return the position of a box of tiles relative to a feature, as `side_of_wall` does for a wall. */
static inline Side side_of_feature(const Grid *g, const Feature *f, const Box *box) {
    if (f->kind == PLANE) {
        Wall plane = {f->x.high, f->y.high, f->nx, f->ny};
        return side_of_wall(g, &plane, box);
    }
    double x = 0.5 * (box->left + box->right), y = 0.5 * (box->low + box->high);
    double half = 0.5 * ((box->right - box->left) + (box->high - box->low));
    if (f->kind == FACE) { /* a disc does not touch a face if its centre is behind the face's line */
        Bounded before = approach(x - f->x.high, y - f->y.high, f->nx, f->ny);
        if (before.value + before.error < -half)
            return CLEAR;
    }
    Bounded distance = distance_to(f, x, y);
    return distance.value - distance.error >= g->radius + f->half_width + half ? CLEAR : NEARBY;
}

/* ---- lists ---- */

/* Append a list to `Grid.lists`. Return false if there is not enough memory. */
static inline bool append_list(State *s, const int *numbers, Index count) {
    Grid *g = &s->grid;
    if (g->listed + count + 1 > g->list_capacity) {
        Index capacity = 2 * g->list_capacity + count + 64;
        int *lists = s->resize(g->lists, (size_t)g->listed * sizeof(int), (size_t)capacity * sizeof(int));
        if (lists == NULL)
            return false;
        g->lists = lists;
        g->list_capacity = capacity;
    }
    memcpy(g->lists + g->listed, numbers, (size_t)count * sizeof(int));
    g->lists[g->listed + count] = NO_OBSTACLE;
    g->listed += count + 1;
    return true;
}

/* Assign the list that begins at index `place` in `Grid.lists` to a block of tiles. */
static inline void assign_list(Grid *g, const Tiles *tiles, Index place) {
    bool has_obstacles = g->lists[FULL_LIST] != NO_OBSTACLE;
    Index first = 1 >> g->tile_bits;
    for (Index row = tiles->low; row < tiles->high; row++) {
        for (Index column = tiles->left; column < tiles->right; column++) {
            bool is_at_rim = row <= first || column <= first || row == g->rows >> g->tile_bits ||
                             column == g->columns >> g->tile_bits;
            g->list_of[row * g->tiles + column] = 2 * (unsigned int)place + (has_obstacles && is_at_rim);
        }
    }
}

/* Assign lists to a block of tiles. `known` contains the numbers of the obstacles near a larger block, which contains
   this block. Return false if there is not enough memory.

   The array `known` must have room for another `count` numbers at this call and at each recursive call. */
static inline bool list_for_tiles(State *s, Tiles tiles, int *known, Index count) {
    Grid *g = &s->grid;
    int *kept = known + count;
    Index kept_count = 0;
    Box box = box_of(g, &tiles);
    for (Index k = 0; k < count; k++) {
        Side side = s->feature_count > 0 ? side_of_feature(g, &s->features[known[k]], &box)
                                         : side_of_wall(g, &s->walls[known[k]], &box);
        if (side == BEHIND) {
            assign_list(g, &tiles, FULL_LIST);
            return true;
        }
        kept[kept_count] = known[k];
        kept_count += side == NEARBY;
    }
    if (kept_count == 0) {
        assign_list(g, &tiles, EMPTY_LIST);
        return true;
    }
    Index width = tiles.right - tiles.left;
    Index height = tiles.high - tiles.low;
    if (width == 1 && height == 1) {
        assign_list(g, &tiles, g->listed);
        return append_list(s, kept, kept_count);
    }
    Tiles half = tiles;
    if (width >= height)
        half.right = tiles.left = tiles.left + width / 2;
    else
        half.high = tiles.low = tiles.low + height / 2;
    return list_for_tiles(s, half, kept, kept_count) && list_for_tiles(s, tiles, kept, kept_count);
}

/* Assign to every tile the list of obstacles, except driven walls, that a disc in the tile may hit. Return false if
   there is not enough memory. */
static inline bool list_obstacles(State *s) {
    Grid *g = &s->grid;
    bool has_features = s->feature_count > 0;
    Index count = has_features ? s->feature_count : s->wall_count;
    Tiles all = {0, g->tiles, 0, (g->rows >> g->tile_bits) + 1};
    g->area.left = line_between(g->x0, g->width, g->columns, 1);
    g->area.right = line_between(g->x0, g->width, g->columns, g->columns + 1);
    g->area.low = line_between(g->y0, g->width, g->rows, 1);
    g->area.high = line_between(g->y0, g->width, g->rows, g->rows + 1);
    /* The array has room for all obstacles once for the whole grid, and once more for each halving. There are at most
       COLUMN_BITS halvings in each direction. */
    int *numbers = s->resize(NULL, 0, (2 * COLUMN_BITS + 2) * (size_t)(count + 1) * sizeof(int));
    if (numbers == NULL)
        return false;
    Index kept_count = 0;
    for (Index k = 0; k < count; k++) {
        numbers[kept_count] = (int)k;
        kept_count += !has_features || !is_driven_wall(&s->driving, s->features[k].wall);
    }
    bool is_done = append_list(s, numbers, 0) && append_list(s, numbers, kept_count) &&
                   list_for_tiles(s, all, numbers, kept_count);
    s->resize(numbers, 0, 0);
    return is_done;
}
