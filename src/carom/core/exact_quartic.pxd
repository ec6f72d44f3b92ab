"""Callback of the core that calls the exact quartic solver in Python: see `ExactQuartic` in polynomial.h."""

from carom.core.carom_core cimport c_bool

cdef extern from "carom/core/quartic/polynomial.h" nogil:
    enum:
        QUARTIC_POWERS

    struct Product:
        double a
        double b

    struct Products:
        double begin "from"
        c_bool is_closed
        int count[5]
        Product products[5][36]

    struct ExactQuartic:
        double (*solve)(void *context, const Products *gap, int index) noexcept nogil
        void *context


cdef inline double solve_quartic(void *context, const Products *gap, int index) noexcept with gil:
    """Return an instant at which a gap closes, by exact arithmetic."""
    from carom.core import exact_quartic

    powers = [
        [(gap.products[k][n].a, gap.products[k][n].b) for n in range(gap.count[k])] for k in range(QUARTIC_POWERS)
    ]
    return exact_quartic.solve_quartic(powers, gap.begin, gap.is_closed, index)


cdef inline ExactQuartic exact_solver() noexcept nogil:
    return ExactQuartic(solve_quartic, NULL)
