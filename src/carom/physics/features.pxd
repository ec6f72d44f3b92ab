"""The compiled form of `features.py`: what a disc meets of a wall, as one row; `numbered.py` writes these from Python."""

from carom.physics.double_double cimport DoubleDouble, two_diff

cdef enum FeatureKind:  # numbered.py has the same numbers
    PLANE = 0  # the whole line of a half-plane
    FACE = 1
    VERTEX = 2
    OUTER_ARC = 3
    INNER_ARC = 4

cdef struct Feature:
    FeatureKind kind
    int wall
    bint whole  # whether an arc is the whole circle, or a vertex: it has no ends
    bint reflex  # whether it is more than half of it
    double half_width
    double fits_below  # radius: of an arc from inside and its stops
    double nx  # of a plane or face: unit normal into the free side, to the nearest floats
    double ny
    DoubleDouble x  # of a face where it begins, of a vertex where it is, of an arc its centre; of a plane one of its points
    DoubleDouble y
    DoubleDouble size  # of a face its length, of an arc its circle's radius, 0 of a vertex
    DoubleDouble ex  # of a face from where it begins to where it ends; of an arc from the centre to where it begins
    DoubleDouble ey
    DoubleDouble fx  # of a face where it ends; of an arc from the centre to where it ends
    DoubleDouble fy

cdef enum:
    FEATURE_NUMBERS = 22  # of a row of numbered.py

cdef struct Mover:  # a disc as seen from a wall
    DoubleDouble x
    DoubleDouble y
    DoubleDouble ux
    DoubleDouble uy
    double radius


cdef inline DoubleDouble pair_at(const double *row) noexcept nogil:
    return DoubleDouble(row[0], row[1])


cdef inline Feature feature_from(const double *row) noexcept nogil:
    """Return the feature that a row of numbers stands for."""
    return Feature(
        <FeatureKind><int>row[0], <int>row[1], row[2] != 0.0, row[3] != 0.0, row[4], row[5], row[6], row[7],
        pair_at(row + 8), pair_at(row + 10), pair_at(row + 12), pair_at(row + 14), pair_at(row + 16), pair_at(row + 18),
        pair_at(row + 20),
    )


cdef inline Mover mover_at(double x, double y, double vx, double vy, double radius) noexcept nogil:
    """Return a disc as seen from a wall that does not move."""
    return Mover(DoubleDouble(x, 0.0), DoubleDouble(y, 0.0), two_diff(vx, 0.0), two_diff(vy, 0.0), radius)
