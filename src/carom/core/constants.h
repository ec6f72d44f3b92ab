/* Constants of the core. Each constant has a value, a reason and, unless it is a ratio or a count, a unit.

   Constants that Python code also defines are compared with it by tests/unit/core/test_constants.py. Integer constants,
   such as capacities, are enums in the headers that use them. */

#pragma once

#include <math.h>
#include <stdbool.h>
#include <stdint.h>

/* ---- compilers ---- */

/* Hints for compilers. CAROM_NOINLINE marks functions that a hot loop calls rarely, because inlining would make them
   occupy the loop's registers. CAROM_ALWAYS_INLINE marks functions that are specialised for a constant argument. */
#if defined(__GNUC__)
#define CAROM_LIKELY(condition) __builtin_expect(!!(condition), 1)
#define CAROM_UNLIKELY(condition) __builtin_expect(!!(condition), 0)
#define CAROM_NOINLINE __attribute__((noinline))
#define CAROM_ALWAYS_INLINE inline __attribute__((always_inline))
#elif defined(_MSC_VER)
#define CAROM_LIKELY(condition) (condition)
#define CAROM_UNLIKELY(condition) (condition)
#define CAROM_NOINLINE __declspec(noinline)
#define CAROM_ALWAYS_INLINE __forceinline
#else
#define CAROM_LIKELY(condition) (condition)
#define CAROM_UNLIKELY(condition) (condition)
#define CAROM_NOINLINE
#define CAROM_ALWAYS_INLINE inline
#endif

/* ---- all files ---- */

/* As a time, in seconds, CAROM_INF means never. As a resolution, CAROM_INF means that the time of the impact is
   completely unknown. */
#define CAROM_INF HUGE_VAL

/* ---- primitives: double_double.h, pair_time.h, line_time.h, feature_time.h ---- */

/* 2^27 + 1, Veltkamp's constant: splits 53 bits into two parts of 26 bits and a sign. */
#define CAROM_SPLITTER 134217729.0
/* Bound of the relative errors of b, c and D, the coefficients and the discriminant of the quadratic equation in
   pair_time.h: 8 roundings of 2^-53. Before the last sum, the terms of b have 4 roundings, those of c have 5, and those
   of D have fewer than 8, including the factor 2 in the bound of D's error. */
#define CAROM_ERROR 0x1p-50
/* For products below this size, the error-free form of pair_time.h is used, because their underflow errors (at most
   2^-1075 each) may not be negligible. */
#define CAROM_NEGLIGIBLE 0x1p-900
/* Adding 2^28 R to a number and subtracting it again rounds the number to a grid. The spacing of the grid is 2^-25 R to
   2^-24 R, so a coordinate up to R keeps about 25 bits. */
#define CAROM_GRID 0x1p28
/* The sums b and c of pair_time.h have errors of about 2^-150 times their largest product. If a sum is smaller than
   this constant times its largest product, it is computed exactly. */
#define CAROM_DOUBTFUL_SUM 0x1p-140
/* The discriminant D of pair_time.h has an error of about 2^-99 times its largest term T. If D is larger than this
   constant times T, the root of D has an error of at most 2^-55 times the root of T. */
#define CAROM_DOUBTFUL_DISCRIMINANT 0x1p-90
/* The length of a face has a relative error of 2^-106. A gap between a disc and a face that is smaller than this
   constant times the terms of the gap is computed from squares, without the rounded length. */
#define CAROM_DOUBTFUL_GAP 0x1p-44
/* Bound of the relative error of the cross product of two vectors: the direction to an end of an arc, and a position.
   The direction and the position consist of rounded pairs of floats. */
#define CAROM_PAIR_ERROR 0x1p-100
/* Result of a function that can't compute a time of impact without the error-free form. A time of impact is never
   negative. */
#define CAROM_UNCERTAIN (-1.0)
/* Range of relative positions, relative velocities and sums of radii in which terms of fourth degree stay within the
   range of floats. `math.frexp` returns exponents from -100 to 100 in this range. */
#define CAROM_PAIR_LEAST 0x1p-101
#define CAROM_PAIR_MOST 0x1p100

/* ---- ordinary numbers: used without scaling, in metres, m/s, seconds and kilograms ---- */

/* Largest and smallest magnitude of an ordinary number. Formulas have terms of at most the fourth degree. For ordinary
   numbers, these terms and their errors stay within the range of floats. */
#define CAROM_ORDINARY 0x1p200
#define CAROM_LEAST_ORDINARY 0x1p-200

/* ---- impact_record.h ---- */

/* The distance from 1 to the next float. A number times CAROM_ULP is at least one unit in the last place of the
   number. */
#define CAROM_ULP 0x1p-52
/* Largest allowed ratio, at an impact of two discs, of the sum of their absolute coordinates to the sum of their radii.
   Each coordinate has at most three roundings. So the computed offset between the centres has an error of at most 3/16
   of their distance. */
#define CAROM_FARTHEST 0x1p49
/* Largest allowed rounding error of a normal: about a thousandth of a radian. With a larger error, the code could not
   distinguish a motion along the tangent from a motion along the normal. */
#define CAROM_COARSEST_NORMAL 0x1p-10

/* ---- event_loop.c ---- */

/* Number of impacts per disc after which a new epoch begins, in which time is counted from 0 again: see clock.h. */
#define CAROM_EPOCH_IMPACTS 32
/* A cell is wider than the largest sum of two radii. CAROM_CELL_MARGIN is the additional width, as a fraction of this
   sum of radii. Any width above the rounding errors of a path and of the cells' edges is correct.
   CAROM_COORDINATE_ERROR is a second additional width, as a fraction of the largest coordinate. CAROM_COORDINATE_ERROR
   is twice the rounding errors of the positions of two discs: eight roundings (2^-53 each) for each disc. */
#define CAROM_CELL_MARGIN 0x1p-10
#define CAROM_COORDINATE_ERROR 0x1p-48
/* Largest number of cells per disc, which limits memory. With more cells, each cell contains too few discs to be worth
   the work of discs that change cells. The value is chosen, not tuned. */
#define CAROM_CELLS_PER_DISC 4.0
/* Number of additional cells for each edge, arc or vertex of a wall. If n features are along the rim of m by m cells,
   each cell at the rim lists about n / 4m features. For m^2 = n / 4, each list has about m features, and a disc crosses
   about m cells on its way to the rim. */
#define CAROM_CELLS_PER_FEATURE 0.25
/* Number of obstacles that can be tested in about the time in which one disc's next event is predicted. */
#define CAROM_LOOKS_PER_PREDICTION 16.0
/* One time plus two different waits may round to the same time only if the waits differ by less than this fraction of
   the later time. */
#define CAROM_TIME_ERROR 0x1p-51
/* Largest relative error of a root that is computed in double precision (the plain form of pair_time.h). The bound is
   valid if each of b, c and D of pair_time.h is more than CAROM_CERTAIN times as large as its own error. */
#define CAROM_ROOT_ERROR 0x1p-22
#define CAROM_CERTAIN 0x1p24

/* Bound of the relative errors of c and D in few_bodies.h. CAROM_FEW_ERROR is 64 times CAROM_ERROR, and so includes the
   roundings of the root and the error of b. */
#define CAROM_FEW_ERROR 0x1p-44

/* ---- frame_loop.c ---- */

/* Margin in a test of squared distances that must not exclude a contact. The square of a rounded distance R differs
   from R^2 by at most two roundings (2^-53 each). */
#define CAROM_ROOT_ROOM 0x1p-50
/* Bound of the rounding error of a disc's path, relative to the path's extent. The bound is valid for all frames for
   which a lower bound of a disc's next impact is used, and includes the rounding error of the lower bound.
   docs/theory/pit.md derives this constant. */
#define CAROM_PATH_MARGIN 0x1p-34
/* Bound of the relative rounding errors of a sum of two times and of a frame's time. */
#define CAROM_TIME_MARGIN 0x1p-50
/* Largest rounding error of a normal, in radians, with which PIT distinguishes slow approaches from rounding errors.
   With CAROM_COARSEST_CONTACT, ignored approaches can't cause a visible overlap: see pit/contact.h. */
#define CAROM_COARSEST_CONTACT 0x1p-20
/* Result of a function if two bodies approach and may overlap at this frame. A wait is never negative. */
#define CAROM_IN_CONTACT (-1.0)
/* 2^64 divided by the golden ratio, as an odd integer. A cell's list is found by hashing its row, column and level (see
   `list_of` in pit/grid.h). CAROM_ROW_STEP spreads rows evenly over the lists, whose number is a power of 2 (D. E.
   Knuth, TAOCP vol. 3, 6.4). Cells in neighbouring columns have neighbouring lists. CAROM_LEVEL_STEP, also odd,
   multiplies the level. */
#define CAROM_ROW_STEP 0x9E3779B97F4A7C15ull
#define CAROM_LEVEL_STEP 0xC2B2AE3D27D4EB4Full
/* Largest magnitude of the number of a row or column of cells. All coordinates farther out are in the last row or
   column. Floats of this size can still represent halves. */
#define CAROM_LAST_CELL 0x1p51
/* Leeway: how far a disc may move before it is put into a cell again. CAROM_LEEWAY_PART is the leeway divided by the
   mean distance of the discs on a level of cells. CAROM_LEAST_LEEWAY_PART is the smallest leeway divided by the largest
   radius of these discs. With a larger leeway, discs change cells less often, but each disc must be compared with more
   other discs. CAROM_LEEWAY_PART and CAROM_LEAST_LEEWAY_PART come from measurements at packing fractions from .05 to
   .6. */
#define CAROM_LEEWAY_PART 0.2
#define CAROM_LEAST_LEEWAY_PART 0.25
/* Relative margin that is added to the reach of a search for near discs. The margin is many times the sum of the
   rounding errors of the reach and of a cell's number. */
#define CAROM_REACH_MARGIN 0x1p-20
/* Costs of a search around a disc, of each cell in the search, and of each body in the search. The unit is the cost of
   one test of two discs in the loop over all pairs. The values are fitted to the times of about a hundred gases, crowds
   and lattices, and rounded up. */
#define CAROM_DISC_WORK 24.0
#define CAROM_CELL_WORK 6.0
#define CAROM_BODY_WORK 3.0
/* Bound of the rounding error of a disc's distance from an edge, relative to the sum of the coordinates and radii. */
#define CAROM_REACH_SLACK 0x1p-44
/* Cost of one disc in a sweep (sweep.h), in tests of two discs. CAROM_SWEEP_WIDTH is the width of a sweep's cell, in
   units of the largest radius. The values were measured at packing fractions from .05 to .8. */
#define CAROM_SWEEP_WORK 12.0
#define CAROM_SWEEP_WIDTH 4.0
/* The excess is the work by which skipping tests has cost more than it saved. If the excess is too large, all tests are
   made at each frame, until CAROM_EXCESS_PART times the work of these frames equals the excess. The value is chosen,
   not tuned. */
#define CAROM_EXCESS_PART 0x1p-6
/* Work that skipping has saved is subtracted from the later cost of skipping. At most the work of CAROM_SAVED_FRAMES
   frames is subtracted. The value is chosen, not tuned. */
#define CAROM_SAVED_FRAMES 64.0

/* ---- falls.h, fall_bounds.h: with u = 2^-53, half a unit in the last place of 1 ---- */

/* Error of a polynomial's coefficient in pairs of floats, relative to the sum of the magnitudes of its terms. The error
   consists of 20 u^2 for the terms and their sum, and 24 u^2 for each of at most 9 shifts of the origin. */
#define CAROM_QUARTIC_PAIR_ERROR 0x1p-98
/* Error of a Bernstein coefficient (root_isolation.h). For each coefficient, add the magnitudes of its terms. The error
   is relative to the largest sum of magnitudes. The error consists of CAROM_ERROR, 10 u for powers, binomials and sums,
   and 4 u for each of at most 52 halvings. */
#define CAROM_BERNSTEIN_ERROR 0x1p-45
/* Error of a Bernstein coefficient in pairs of floats, relative to the same sum as CAROM_BERNSTEIN_ERROR. The error
   consists of CAROM_QUARTIC_PAIR_ERROR and, for at most 120 halvings, the roundings in CAROM_BERNSTEIN_ERROR with 3 u^2
   instead of u. */
#define CAROM_BERNSTEIN_PAIR_ERROR 0x1p-95
/* Range of the instants c (root_isolation.h) at which the terms of a quartic and their underflow errors stay within the
   range of floats. */
#define CAROM_LEAST_SCALE 0x1p-90
#define CAROM_MOST_SCALE 0x1p90
/* Least sum of the magnitudes of the terms of a polynomial's constant coefficient. For larger sums, underflow errors of
   terms are smaller than the rounding error of this coefficient. */
#define CAROM_LEAST_SIZE 0x1p-600
/* Bound of the relative error of a term in a lower bound of a time of impact: 32 times 2^-53, which is more than the
   roundings of the term. */
#define CAROM_BOUND_ERROR 0x1p-48
/* Upper bounds of the underflow errors of a product, and of the root of a sum of products. */
#define CAROM_BOUND_UNDERFLOW 0x1p-1000
#define CAROM_BOUND_LENGTH_UNDERFLOW 0x1p-500

/* ---- damping, exponentials ---- */

/* With the damping rate c and the time t, the undamped time of damping.h is s = t (1 - c t / 2 + ...). If c t is
   smaller than this constant, s differs from t by less than half a unit in the last place. */
#define CAROM_DAMPING_LEAST 0x1p-54
/* If |x| is at most this constant, e^x rounds to 1. If |x| is smaller, e^x - 1 and the logarithm of 1 + x round to x,
   because the next term of both series is about x^2 / 2. */
#define CAROM_EXP_LINEAR 0x1p-54
/* An upper bound of the relative errors of e^x, e^x - 1 and the logarithm as pairs. The comments in exponentials.h
   state the individual errors, whose sum is smaller. Measured errors are at most 2^-103. */
#define CAROM_EXP_ERROR 0x1p-100
/* ln 2 / 32 in three parts. The first two parts have 37 bits, so that their products with integers up to 2^16 are
   exact. The sum of the parts has an error of 2^-137. */
#define CAROM_STEP_HIGH 0x1.62e42fefa0000p-6
#define CAROM_STEP_MIDDLE 0x1.cf79abc9e0000p-45
#define CAROM_STEP_LOW 0x1.d9cc01f97b57ap-84
#define CAROM_STEPS_PER_UNIT 0x1.71547652b82fep+5
#define CAROM_LN2 0x1.62e42fefa39efp-1
/* Upper limit of x in e^x. For larger x, e^x exceeds the largest float. */
#define CAROM_EXP_MOST 710.0

/* ---- solvers/certified/bounds.pyx: numbers are scaled by powers of two, see `carom.solvers.units` ---- */

/* Half a unit in the last place of 1. */
#define CAROM_ROUNDOFF 0x1p-53
/* 1 + 32 CAROM_ROUNDOFF: a factor that enlarges an error bound by more than the rounding errors of its computation. */
#define CAROM_WIDER (1.0 + 0x1p-48)
/* Lower limit of the error bounds of coordinates and velocity components. */
#define CAROM_TINY 0x1p-500
/* Bound of the underflow error in two products. */
#define CAROM_FLOOR 0x1p-1060
/* A float of at least this size has full precision, and scaling preserves all its bits. */
#define CAROM_NORMAL 0x1p-1020
/* Largest speed at which the underflow error of a wait moves a body by less than CAROM_TINY. */
#define CAROM_FASTEST 0x1p400
