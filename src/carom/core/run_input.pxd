"""Declarations of `run_input.h`, and conversion of Python arrays to a `RunInput`, for the bindings."""

from libc.string cimport memset

from carom.core.carom_core cimport ContactFriction, Corners, Index, Law, Resize
from carom.core.exact_quartic cimport ExactQuartic
from carom.core.record_rows cimport carom_enlarge

cdef extern from "carom/core/run_input.h" nogil:
    struct RunInput:
        const double *position
        const double *velocity
        const double *radius
        const double *mass
        const double *spin
        const double *inertia
        Index disc_count
        Index wall_count
        const double *materials
        const double *driven
        const double *legs
        Index driven_count
        Index leg_count
        bint has_spins
        bint has_finite_walls
        bint has_acceleration
        double gravity[2]
        double deceleration
        double rolling_resistance
        Law law
        Resize resize
        const double *walls
        const double *features
        Index feature_count
        const double *grounds
        const double *never_lists
        Index never_length
        double cell_factor
        Index standstill
        bint solves_all_pairs
        ExactQuartic exact
        Corners corners
        double until
        const double *chains
        const double *edges
        Index edge_count
        double step
        double rate
        double damping
        bint skips
        double max_waste


cdef inline Law law_of(start, double contact_duration) except *:
    """Return the law of a `carom.model.disc_arrays.DiscArrays`, with a contact duration for the TC model."""
    return Law(
        start.restitution, start.wall_restitution, contact_duration,
        ContactFriction(start.friction, start.tangential_restitution),
        ContactFriction(start.wall_friction, start.wall_tangential_restitution),
    )


cdef inline const double *floats(list kept, values) except? NULL:
    """Return the address of an array's numbers; NULL if the array is empty. The list `kept` keeps the array alive."""
    import numpy as np

    array = np.ascontiguousarray(values, np.float64)
    cdef const double[::1] numbers = array.ravel()
    kept.append(numbers)
    return &numbers[0] if numbers.shape[0] > 0 else NULL


cdef inline RunInput input_of(start, acceleration, list kept) except *:
    """Return those parts of a run's input that both solvers use. The list `kept` keeps the arrays of the input alive.

    `start` is a `carom.model.disc_arrays.DiscArrays`. `acceleration` is a `carom.solvers.run.Start` with gravity or a
    decelerating table; None if no disc accelerates. The caller must keep `kept` as long as the input is used.
    """
    cdef RunInput given
    memset(&given, 0, sizeof(RunInput))
    given.position, given.velocity = floats(kept, start.position_m), floats(kept, start.velocity_m_s)
    given.radius, given.mass = floats(kept, start.radius_m), floats(kept, start.mass_kg)
    given.disc_count, given.wall_count = len(start.radius_m), len(start.walls)
    given.has_spins, given.has_finite_walls = start.turns, not start.has_half_planes
    if given.has_spins or acceleration is not None:
        given.spin, given.inertia = floats(kept, start.spins), floats(kept, start.inertia)
    given.has_acceleration = acceleration is not None
    if acceleration is not None:
        given.gravity[0], given.gravity[1] = acceleration.gravity_m_s2
        given.deceleration = acceleration.table_deceleration_m_s2
        given.rolling_resistance = acceleration.wall_rolling_resistance
    given.law = law_of(start, 0.0)
    given.resize = carom_enlarge
    return given
