"""The impact law of a start, `carom.disc_arrays.DiscArrays`, for the bindings."""

from carom.core.carom_core cimport ContactFriction, Index, Law


cdef inline Law law_of(start, double contact_duration) except *:
    """Return the law of a start, with a contact duration of the TC model."""
    return Law(
        start.restitution, start.wall_restitution, contact_duration,
        ContactFriction(start.friction, start.tangential_restitution),
        ContactFriction(start.wall_friction, start.wall_tangential_restitution),
    )


cdef inline int write_wall_laws(Law *laws, const Law *law, start) except -1:
    """Write the law of each wall of a start: each has its own material."""
    cdef Index k
    for k, (restitution, friction) in enumerate(start.materials):
        laws[k] = law[0]
        laws[k].wall_restitution, laws[k].wall_contact.friction = restitution, friction
    return 0
