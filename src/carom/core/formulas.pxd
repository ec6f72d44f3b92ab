"""Declarations of formulas for times of impact and impulses, for `primitives.pyx`."""

from carom.core.carom_core cimport ContactFriction
from carom.core.exact_quartic cimport ExactQuartic

cdef extern from "carom/core/constants.h" nogil:
    const double CAROM_INF
    const double CAROM_PAIR_LEAST
    const double CAROM_PAIR_MOST

cdef extern from "carom/core/arithmetic/double_double.h" nogil:
    struct DoubleDouble:
        double high
        double low

    double lesser(double a, double b)
    double greater(double a, double b)
    DoubleDouble two_diff(double a, double b)

cdef extern from "carom/core/feature.h" nogil:
    enum:
        FEATURE_NUMBERS

    enum FeatureKind:
        FACE
        INNER_ARC

    struct Feature:
        FeatureKind kind
        int wall
        double nx
        double ny
        DoubleDouble x
        DoubleDouble y

    struct Mover:
        DoubleDouble x
        DoubleDouble y
        DoubleDouble ux
        DoubleDouble uy
        double radius

    Feature feature_from(const double *row)

cdef extern from "carom/core/straight/line_time.h" nogil:
    DoubleDouble wall_gap(double x, double y, double radius, double qx, double qy, double nx, double ny)
    DoubleDouble wall_speed(double vx, double vy, double nx, double ny)
    double wall_time(
        double x, double y, double vx, double vy, double radius, double qx, double qy, double nx, double ny
    )

cdef extern from "carom/core/straight/feature_time.h" nogil:
    enum PathStart:
        ELSEWHERE
        JUST_LEFT

    struct Touch:
        double time
        bint glides

    struct Direction:
        double x
        double y

    DoubleDouble reach_of(const Mover *disc, const Feature *arc)
    Touch feature_time(const Mover *disc, const Feature *feature, PathStart start)
    Direction normal_at(const Feature *feature, const Mover *disc)
    double feature_gap(const Mover *disc, const Feature *feature)

cdef extern from "carom/core/parabola/fall_time.h" nogil:
    struct FallingDisc:
        double x
        double y
        double vx
        double vy
        double radius

    double descent_time(DoubleDouble gap, DoubleDouble speed, DoubleDouble pull)
    double disc_fall_time(
        const ExactQuartic *exact, const FallingDisc *disc, double fixed_x, double fixed_y, double fixed_radius,
        double ax, double ay, bint has_just_left, double leaving,
    )
    double feature_fall_time(
        const ExactQuartic *exact, const Mover *disc, const Feature *feature, double ax, double ay, bint has_just_left,
        double leaving,
    )

cdef extern from "carom/core/impact_law.h" nogil:
    double tangential_impulse(
        const ContactFriction *contact, double slip, double inverse_effective_mass, double pressed
    )
    double pair_tangential_impulse(
        const ContactFriction *contact, double dx, double dy, double ux, double uy, double surface,
        double inverse_effective_mass, double normal,
    )

cdef extern from "carom/core/wall_contact_law.h" nogil:
    struct Frictions:
        double friction
        double turning
        bint sticks
        bint blocks

    struct Slips:
        double slip
        double rim

    Frictions frictional_impulses(
        const ContactFriction *contact, double rolling_resistance, Slips before, double y, double pressed
    )
