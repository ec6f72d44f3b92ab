"""Newton's law of restitution for two discs without friction: the compiled form of `pair_push` in `impact_law.py`."""


cdef inline double pair_push(
    double dx, double dy, double ux, double uy, double inverse_masses, double restitution
) noexcept nogil:
    along = dx * ux + dy * uy
    if not along < 0.0:
        return 0.0
    return (1.0 + restitution) * along / ((dx * dx + dy * dy) * inverse_masses)
