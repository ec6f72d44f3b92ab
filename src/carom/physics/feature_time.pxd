"""The compiled form of `feature_time.py` without gravity, operation by operation; a test holds the two to the same bits."""

from libc.math cimport sqrt

from carom.constants cimport INF
from carom.physics.arc_time cimport Touch, from_pair, inner_arc_time, outer_arc_time
from carom.physics.face_time cimport face_time
from carom.physics.features cimport FACE, INNER_ARC, PLANE, Feature, Mover
from carom.physics.wall_time cimport wall_time

cdef struct Direction:  # a unit vector
    double x
    double y


cdef inline Touch feature_time(const Mover *disc, const Feature *feature, bint just_left) noexcept nogil:
    """Return when a disc in straight uniform motion touches a feature; `just_left` as in the plain form."""
    if feature.kind == INNER_ARC:
        return inner_arc_time(disc, feature, just_left)
    if just_left:
        return Touch(INF, False)
    if feature.kind == FACE:
        return Touch(face_time(disc, feature), False)
    if feature.kind == PLANE:
        return Touch(wall_time(
            disc.x.high, disc.y.high, disc.ux.high, disc.uy.high, disc.radius, feature.x.high, feature.y.high, feature.nx,
            feature.ny,
        ), False)
    return Touch(outer_arc_time(disc, feature), False)


cdef inline Direction normal_at(const Feature *feature, const Mover *disc) noexcept nogil:
    """Return the unit vector from a feature to a disc that touches it."""
    if feature.kind == FACE or feature.kind == PLANE:
        return Direction(feature.nx, feature.ny)
    x = from_pair(disc.x, feature.x).high
    y = from_pair(disc.y, feature.y).high
    distance = sqrt(x * x + y * y)
    if feature.kind == INNER_ARC:
        return Direction(-x / distance, -y / distance)
    return Direction(x / distance, y / distance)
