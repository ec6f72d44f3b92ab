/* Every constant that the compiled rooms compute with: value, unit where it has one, and reason. `constants.pxd` names
   them for Cython; tests/unit/test_constants.py holds those that plain Python has too to the same values. No unit: a
   ratio or a count. Sizes of structs and numbers of things are enums next to what they count. */

#ifndef CAROM_CONSTANTS_H
#define CAROM_CONSTANTS_H

#include <math.h>

/* Of times (seconds): never. Of resolutions: known to no time at all. */
#define CAROM_INF HUGE_VAL

/* ---- physics: double_double, pair_time, face_time, arc_time, pair_times ---- */

/* 2^27 + 1, Veltkamp's constant: 53 bits become 26, 26 and a sign. */
#define CAROM_SPLITTER 134217729.0
/* 8 roundings: more than the terms of b (4), c (5) and, with its factor 2, of D gather before their last sum. */
#define CAROM_ERROR 0x1p-50
/* Where products of this size count, underflow (2^-1075 at most, each) may count too, and the error-free form decides. */
#define CAROM_NEGLIGIBLE 0x1p-900
/* Adding and taking away 2^28 R rounds to a grid of 2^-25 R to 2^-24 R: 25 bits or so for any coordinate up to R. */
#define CAROM_GRID 0x1p28
/* b and c are right to some 2^-150 of their largest product: below this part of it, the sum is made exact. */
#define CAROM_DOUBTFUL_SUM 0x1p-140
/* D is right to some 2^-99 of its terms, so its root, where D is above this part of them, to 2^-55 of theirs. */
#define CAROM_DOUBTFUL_DISCRIMINANT 0x1p-90
/* The length of a face is right to 2^-106 of itself: below this part of the terms, the gap is made of squares instead. */
#define CAROM_DOUBTFUL_GAP 0x1p-44
/* More than the roundings of an end's direction and of a place, which are pairs, make of their cross product. */
#define CAROM_PAIR_ERROR 0x1p-100
/* In place of a time of impact, which is 0 or more: the error-free form must decide. */
#define CAROM_UNCERTAIN (-1.0)
/* Relative positions and velocities, and sums of radii, whose terms of fourth degree stay within the range of floats:
   `math.frexp` gives their exponents as -100 to 100. */
#define CAROM_PAIR_LEAST 0x1p-101
#define CAROM_PAIR_MOST 0x1p100

/* ---- limits of what is computed with as it is, in metres, metres a second, seconds and kilograms ---- */

/* Formulas are of fourth degree at most: their terms, and what rounding leaves of these, stay within the range of floats. */
#define CAROM_ORDINARY 0x1p200
#define CAROM_LEAST_ORDINARY 0x1p-200

/* ---- impacts: resolution ---- */

/* A unit in the last place of 1: at least one of any number, in parts of it. */
#define CAROM_ULP 0x1p-52
/* Coordinates over the sum of the radii. Each is at most three roundings off at an impact: here the place of a centre
   seen from the other is off by at most 3/16 of their distance. */
#define CAROM_FARTHEST 0x1p49

/* ---- event_driven ---- */

/* Impacts a disc after which time is counted anew, see `new_epoch` in kernel.pyx. */
#define CAROM_EPOCH_IMPACTS 32
/* How much wider than the largest sum of two radii a cell is, in parts of that sum: anything that leaves room for the
   roundings of a path and of the edges. Where coordinates are too large for that, the second, in parts of the
   largest: twice the eight roundings (2^-53) of each of two discs' places. */
#define CAROM_CELL_MARGIN 0x1p-10
#define CAROM_COORDINATE_ERROR 0x1p-48
/* Cells a disc at most: beyond that they hold too little to be worth crossing. Chosen, not tuned: bounds memory. */
#define CAROM_CELLS_PER_DISC 4.0
/* And for each side, arc or vertex of a wall: of n along the rim of m by m cells one at the rim knows n / 4m, and as many
   cells are crossed on the way to it where m^2 = n / 4. */
#define CAROM_CELLS_PER_FEATURE 0.25
/* Obstacles looked at in the time in which a disc is predicted, roughly. */
#define CAROM_LOOKS_PER_PREDICTION 16.0
/* Two waits that differ by more than this part of the later time never round to one time. */
#define CAROM_TIME_ERROR 0x1p-51
/* Relative error that a root of the plain form may have, and by how much each of its three terms must exceed its own
   error for that to be certain. */
#define CAROM_ROOT_ERROR 0x1p-22
#define CAROM_CERTAIN 0x1p24

/* ---- pit ---- */

/* A root that rounds to R is of a square within two roundings (2^-53) of R^2. */
#define CAROM_ROOT_ROOM 0x1p-50
/* What the roundings of a disc's path over the frames that a bound holds for are at most, in parts of its extent, and
   those of a bound itself: `docs/physics.md`, section 4, derives it. */
#define CAROM_PATH_MARGIN 0x1p-34
/* Above the roundings of a sum of times and of a frame's instant, in parts of it. */
#define CAROM_TIME_MARGIN 0x1p-50
/* In place of a wait, which is 0 or more: the two approach and may overlap at this very frame. */
#define CAROM_IN_CONTACT (-1.0)
/* Odd, 2^64 over the golden ratio: rows are spread evenly over any power of 2 of chains (D. E. Knuth, TAOCP vol. 3,
   6.4), and columns stay side by side. The second, odd as well, keeps levels apart. */
#define CAROM_ROW_STEP 0x9E3779B97F4A7C15ull
#define CAROM_LEVEL_STEP 0xC2B2AE3D27D4EB4Full
/* Cells further out than this are one. Floats that large still have a place for halves. */
#define CAROM_LAST_CELL 0x1p51
/* What the roundings of a cell's number and of a reach are together, many times over, in parts of the reach. */
#define CAROM_REACH_MARGIN 0x1p-20
/* What it costs to look around a disc, into a cell, and at a body: in tests of plain looping. Fitted to the times of
   some hundred gases, crowds and lattices, and rounded up. */
#define CAROM_DISC_WORK 24.0
#define CAROM_CELL_WORK 6.0
#define CAROM_BODY_WORK 3.0
/* Where skipping has not paid, frames are looped plainly until it has cost no more than this part of them. Chosen. */
#define CAROM_EXCESS_PART 0x1p-6
/* What has been saved counts for this many frames. Chosen. */
#define CAROM_SAVED_FRAMES 64.0

/* ---- certified: bounds, scaled by powers of two of `carom.solvers.units` ---- */

/* Half a unit in the last place of 1. */
#define CAROM_ROUNDOFF 0x1p-53
/* 1 and 32 ROUNDOFF. */
#define CAROM_WIDER (1.0 + 0x1p-48)
/* Least error of a coordinate and of a component of a velocity. */
#define CAROM_TINY 0x1p-500
/* Above what underflow takes from two products. */
#define CAROM_FLOOR 0x1p-1060
/* From here up a float has all its bits, and can be scaled by what follows. */
#define CAROM_NORMAL 0x1p-1020
/* Speed up to which an underflow of a wait is covered by TINY. */
#define CAROM_FASTEST 0x1p400

#endif
