"""What every compiled solver keeps of walls, spins and impacts. Metres, seconds, kilograms, radians.

A body is a disc (0 or more) or wall k (-1 - k), as in `carom.trace`.
"""

from carom.constants cimport INF

ctypedef Py_ssize_t Index

cdef enum:
    NOBODY = -1  # no disc: an empty place, no partner
    NO_FEATURE = -1  # no feature of a wall, or none that matters

cdef struct Wall:  # the free side is (p - q).n >= 0
    double x  # q, a point of the surface
    double y
    double nx  # n, unit normal into the free side
    double ny

cdef struct Surface:  # of a wall that is driven, or whose surface runs
    double vx  # velocity of the wall
    double vy
    double belt  # how fast its surface runs to the left of the normal, metres a second

cdef struct Turning:  # of a disc, in a scene in which something turns; apart from a solver's own row of it
    double spin  # radians a second, counterclockwise
    double inverse_inertia_ratio  # 1/k, mass times radius squared over the moment of inertia; 0: it never turns


# ---- the law ----

cdef struct ContactFriction:  # of two bodies that touch
    double friction  # Coulomb's coefficient f, 0 or more
    double restitution  # b, -1 to 1: the slip after an impact in which they stick, over that before, turned round

cdef struct Law:
    double restitution  # of two discs
    double wall_restitution
    double contact_duration  # of the TC model, seconds: an impact so soon after a disc's last loses no energy; 0 for none
    ContactFriction contact  # of two discs
    ContactFriction wall_contact

cdef struct Body:  # a disc as the law sees it
    double *velocity  # x, y
    double inverse_mass  # 0: it never moves
    double radius
    Turning *turning  # read only where something turns


# ---- recorded impacts ----

cdef struct Impact:  # a row of `carom.trace.IMPACT_DTYPE`
    double time  # since the start
    long long first  # disc
    long long second  # body
    double normal[2]  # unit vector from first to second
    double first_before[2]  # velocities
    double second_before[2]
    double first_after[2]
    double second_after[2]

cdef struct Before:  # velocities before an impact; that of a wall is 0 where it stands
    double first[2]
    double second[2]

cdef struct Spins:  # a row of `carom.trace.SPIN_DTYPE`
    double first_before
    double second_before
    double first_after
    double second_after

cdef struct LastContact:  # an impact as the next one of the same disc sees it
    double latest  # that it can have been, since the start; -INF for none
    double nx
    double ny
    int feature  # of a finite wall, on which no friction acts; NO_FEATURE for anything else
    bint elastic  # whether nothing is lost on that

cdef struct Recent:  # all that tells whether a disc's next impact will be ambiguous, see ambiguity.pxd
    LastContact furthest
    LastContact across

cdef struct Contact:  # where an impact was, of a run with finite walls; a row of `carom.solvers.rows.CONTACT_DTYPE`
    double x  # centre of the first disc
    double y
    long long feature  # its number, or NO_FEATURE for another disc

#: Whether a disc that meets two features at one instant goes on in the same way, whichever comes first.
ctypedef bint (*Decides)(void *asked, int one, int other, bint elastic) noexcept nogil

cdef struct Corners:
    Decides decides  # called for numbers of features alone
    void *asked

cdef struct Record:
    Impact *rows
    Spins *spins  # as many as rows, where something turns
    Contact *contacts  # as many as rows, where there are finite walls
    bint turns
    bint locates  # whether there are
    Corners corners
    Index count
    Index capacity
    long long *ambiguous  # numbers of rows, counted on from `taken`
    Index ambiguous_count
    Index ambiguous_capacity
    Index taken  # rows handed out before those in `rows`
    Recent *recent  # one a disc
    bint wanted
    double begin  # since the start: what is recorded lies between these two
    double end
