"""Declarations of `carom_core.h` for the bindings."""

from libc.stdint cimport int64_t

ctypedef Py_ssize_t Index

cdef extern from "<stdbool.h>":
    ctypedef bint c_bool "bool"  # C's bool, since Cython's bint would be an int in the type of a function that C calls

cdef extern from "carom/core/carom_core.h" nogil:
    ctypedef void *(*Resize)(void *memory, size_t used, size_t size) noexcept nogil

    struct Turning:
        double spin
        double inverse_inertia_ratio

    struct ContactFriction:
        double friction
        double restitution

    struct Law:
        double restitution
        double wall_restitution
        double contact_duration
        ContactFriction contact
        ContactFriction wall_contact

    struct Impact:
        pass

    struct Spins:
        pass

    struct Contact:
        pass

    struct Recent:
        pass

    ctypedef c_bool (*IsOrderFree)(void *context, int one, int other, c_bool elastic) noexcept nogil

    struct Corners:
        IsOrderFree is_order_free
        void *context

    struct Record:
        Impact *rows
        Spins *spins
        Contact *contacts
        bint has_spins
        bint has_contacts
        Index count
        Index capacity
        int64_t *ambiguous
        Index ambiguous_count
        Index released
        bint is_wanted
