"""What an impact does: restitution along the normal and friction across it. The one compiled form of the law.

Design:

a) A function of one impact, on pointers to velocities and spins, in place. Each solver has rows of its own: the kernel's
   disc is a cache line with a time, that of PIT has a cell, that of two discs neither. What they share is a pointer to
   two velocities, so the law asks for no more, and no row is copied.
b) Solvers move, ask, collide and record. Whether bodies meet, when, and whether energy is lost (the TC model, `elastic`)
   is theirs to say; the law takes two bodies in contact and nothing about time.
c) No unit vector. With d from centre to centre and u the velocity of the second seen from the first, the normal impulse
   is ``g d``: no rounding of d's length can do work. The tangential impulse is ``h (d turned by +90 degrees)``.
d) An impact never pulls: where rounding has made a separation of the weakest of grazes, the impulse is 0. No function
   compares with a small number.
e) `turns` is a constant where it is called: what turns costs nothing where nothing does. Inlined functions, no function
   pointers: a call that a compiler can't see through costs the kernel a tenth of its speed.
f) Operation by operation that of `carom.physics.impact_law` and `carom.physics.friction`, which say where the formulas
   come from; as arrays it is `carom.physics.rough_impact`, in ball arithmetic `carom.solvers.certified.impacts`. Tests
   hold compiled and plain to the same bits, so no operation may be reordered or fused.
"""

from libc.math cimport sqrt

from carom.solvers.impact.structs cimport Body, ContactFriction, Index, Law, Spins, Surface, Wall


# ---- the law of a start, `carom.disc_arrays.DiscArrays` ----

cdef inline Law law_of(start, double contact_duration) except *:
    """Return the law of a start, with a contact duration of the TC model."""
    return Law(
        start.restitution, start.wall_restitution, contact_duration,
        ContactFriction(start.friction, start.tangential_restitution),
        ContactFriction(start.wall_friction, start.wall_tangential_restitution),
    )


cdef inline int write_wall_laws(Law *laws, const Law *law, start) except -1:
    """Write the law on each wall of a start: each has its own material."""
    cdef Index k
    for k, (restitution, friction) in enumerate(start.materials):
        laws[k] = law[0]
        laws[k].wall_restitution, laws[k].wall_contact.friction = restitution, friction
    return 0


# ---- impulses ----

cdef inline double normal_impulse(
    double dx, double dy, double ux, double uy, double inverse_masses, double restitution
) noexcept nogil:
    """Return ``g <= 0``: the first disc receives the impulse ``g d``, the second ``-g d``."""
    along = dx * ux + dy * uy
    if not along < 0.0:
        return 0.0
    return (1.0 + restitution) * along / ((dx * dx + dy * dy) * inverse_masses)


cdef inline double tangential_impulse(
    const ContactFriction *contact, double slip, double inverse_effective_mass, double pressed
) noexcept nogil:
    """Return the impulse of friction: that which makes the bodies stick, or the most that Coulomb's cone allows."""
    sticking = (1.0 + contact.restitution) * slip / inverse_effective_mass
    most = contact.friction * pressed
    if sticking > most:
        return most
    return -most if sticking < -most else sticking


cdef inline double pair_tangential_impulse(
    const ContactFriction *contact, double dx, double dy, double ux, double uy, double surface,
    double inverse_effective_mass, double normal
) noexcept nogil:
    """Return ``h``: the first disc receives the impulse ``h (dy, -dx)``; `surface` is ``|d| (R1 w1 + R2 w2)``."""
    return tangential_impulse(
        contact, dy * ux - dx * uy + surface, (dx * dx + dy * dy) * inverse_effective_mass, -normal
    )


# ---- two discs ----

cdef inline double bounce_pair(
    double dx, double dy, double *v1, double inverse_mass1, double *v2, double inverse_mass2, double restitution
) noexcept nogil:
    """Give two discs, the second at ``d`` from the first, their velocities after an impact without friction; return g."""
    g = normal_impulse(dx, dy, v2[0] - v1[0], v2[1] - v1[1], inverse_mass1 + inverse_mass2, restitution)
    v1[0] += g * inverse_mass1 * dx
    v1[1] += g * inverse_mass1 * dy
    v2[0] -= g * inverse_mass2 * dx
    v2[1] -= g * inverse_mass2 * dy
    return g


cdef inline void slide_pair(
    const ContactFriction *contact, double dx, double dy, double ux, double uy, double g, Body *a, Body *b
) noexcept nogil:
    """Let friction act on two discs that had the relative velocity u and were given the normal impulse ``g d``."""
    distance = sqrt(dx * dx + dy * dy)
    surface = distance * (a.radius * a.turning.spin + b.radius * b.turning.spin)
    inverse_effective_mass = (
        a.inverse_mass * (1.0 + a.turning.inverse_inertia_ratio) + b.inverse_mass * (1.0 + b.turning.inverse_inertia_ratio)
    )
    h = pair_tangential_impulse(contact, dx, dy, ux, uy, surface, inverse_effective_mass, g)
    a.velocity[0] += h * a.inverse_mass * dy
    a.velocity[1] -= h * a.inverse_mass * dx
    b.velocity[0] -= h * b.inverse_mass * dy
    b.velocity[1] += h * b.inverse_mass * dx
    a.turning.spin -= h * distance * a.inverse_mass * a.turning.inverse_inertia_ratio / a.radius
    b.turning.spin -= h * distance * b.inverse_mass * b.turning.inverse_inertia_ratio / b.radius


cdef inline double collide_discs(
    const Law *law, double dx, double dy, Body *a, Body *b, bint elastic, bint turns, Spins *spins
) noexcept nogil:
    """Carry out the impact of two discs in contact, the second at ``d`` from the first; return g.

    It can be elastic and without friction, whatever the law says. `spins` is written where something turns.
    """
    ux = b.velocity[0] - a.velocity[0]
    uy = b.velocity[1] - a.velocity[1]
    g = bounce_pair(
        dx, dy, a.velocity, a.inverse_mass, b.velocity, b.inverse_mass, 1.0 if elastic else law.restitution
    )
    if turns:
        spins.first_before, spins.second_before = a.turning.spin, b.turning.spin
        if law.contact.friction > 0.0 and not elastic:
            slide_pair(&law.contact, dx, dy, ux, uy, g, a, b)
        spins.first_after, spins.second_after = a.turning.spin, b.turning.spin
    return g


# ---- a disc and a wall ----

cdef inline double collide_wall(
    const Law *law, const Wall *wall, const Surface *surface, Body *a, bint elastic, bint turns, Spins *spins
) noexcept nogil:
    """Carry out the impact of a disc on a wall, as `collide_discs`; return its velocity before, off the wall.

    `surface` is NULL where the wall stands and its surface does, too.
    """
    vx = a.velocity[0]
    vy = a.velocity[1]
    if surface != NULL:
        vx -= surface.vx
        vy -= surface.vy
    along = vx * wall.nx + vy * wall.ny
    cdef double speed = 0.0
    if along < 0.0:
        speed = (1.0 + (1.0 if elastic else law.wall_restitution)) * along
        a.velocity[0] -= speed * wall.nx
        a.velocity[1] -= speed * wall.ny
    if turns:
        spins[0] = Spins(a.turning.spin, 0.0, 0.0, 0.0)
        if law.wall_contact.friction > 0.0 and along < 0.0 and not elastic:
            slip = vx * wall.ny - vy * wall.nx + a.radius * a.turning.spin
            if surface != NULL and surface.belt != 0.0:
                slip += surface.belt
            h = tangential_impulse(&law.wall_contact, slip, 1.0 + a.turning.inverse_inertia_ratio, -speed)
            a.velocity[0] -= h * wall.ny
            a.velocity[1] += h * wall.nx
            a.turning.spin -= h * a.turning.inverse_inertia_ratio / a.radius
        spins.first_after = a.turning.spin
    return along
