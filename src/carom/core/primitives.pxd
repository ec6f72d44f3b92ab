"""Declarations of the headers of times of impact, for the bindings and the tests."""

cdef extern from "carom/core/constants.h" nogil:
    const double CAROM_INF
    const double CAROM_PAIR_LEAST
    const double CAROM_PAIR_MOST

cdef extern from "carom/core/double_double.h" nogil:
    struct DoubleDouble:
        double high
        double low

    double lesser(double a, double b)
    double greater(double a, double b)
    DoubleDouble two_sum(double a, double b)
    DoubleDouble two_diff(double a, double b)
    DoubleDouble two_prod(double a, double b)

cdef extern from "carom/core/pair.h" nogil:
    struct Encounter:
        DoubleDouble x
        DoubleDouble y
        DoubleDouble ux
        DoubleDouble uy
        DoubleDouble reach

    Encounter encounter(
        double x1, double y1, double vx1, double vy1, double r1,
        double x2, double y2, double vx2, double vy2, double r2,
    )
    double exact_pair_time(Encounter e)
    double pair_time(
        double x1, double y1, double vx1, double vy1, double r1,
        double x2, double y2, double vx2, double vy2, double r2,
    )

cdef extern from "carom/core/feature.h" nogil:
    enum:
        FEATURE_NUMBERS

    enum FeatureKind:
        PLANE
        FACE
        VERTEX
        OUTER_ARC
        INNER_ARC

    struct Feature:
        FeatureKind kind
        int wall

    struct Mover:
        DoubleDouble x
        DoubleDouble y
        DoubleDouble ux
        DoubleDouble uy
        double radius

    Feature feature_from(const double *row)

cdef extern from "carom/core/half_plane.h" nogil:
    double wall_time(
        double x, double y, double vx, double vy, double radius, double qx, double qy, double nx, double ny
    )

cdef extern from "carom/core/arc.h" nogil:
    struct Touch:
        double time
        bint glides

cdef extern from "carom/core/feature_time.h" nogil:
    struct Direction:
        double x
        double y

    Touch feature_time(const Mover *disc, const Feature *feature, bint just_left)
    Direction normal_at(const Feature *feature, const Mover *disc)
