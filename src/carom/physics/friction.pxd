"""The compiled form of `friction.py`, to the same bits."""

cdef struct Grip:  # how two bodies rub against each other
    double friction
    double restitution


cdef inline double friction_impulse(const Grip *grip, double slip, double yielding, double pressed) noexcept nogil:
    held = (1.0 + grip.restitution) * slip / yielding
    most = grip.friction * pressed
    if held > most:
        return most
    return -most if held < -most else held


cdef inline double pair_rub(
    const Grip *grip, double dx, double dy, double ux, double uy, double surface, double yielding, double push
) noexcept nogil:
    return friction_impulse(grip, dy * ux - dx * uy + surface, (dx * dx + dy * dy) * yielding, -push)
