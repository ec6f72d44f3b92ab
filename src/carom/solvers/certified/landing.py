"""End of infinitely many bounces in certified runs: the disc's state, and a check that no other event comes earlier.

If the disc slips in one direction in all bounces, or sticks in all of them, geometric series give its later speed, slip
and position: see `docs/theory/contact.md`.
"""

from __future__ import annotations

from collections.abc import Iterable

from flint import arb

from carom.core.wall_parts import Round
from carom.model.disc_arrays import Material
from carom.model.trace import wall_body, wall_index
from carom.solvers.certified.ball_arithmetic import ZERO, ball
from carom.solvers.certified.contact_state import BallGround, Bounce, GlideState
from carom.solvers.certified.disc_states import BallBodies
from carom.solvers.certified.two_frictions import share_frictions, sign_of


def sum_bounces(
    bodies: BallBodies, i: int, ground: BallGround, bounce: Bounce, hop: arb, tolerance: arb | None
) -> GlideState | None:
    """Return the state of a disc after all remaining bounces; None if it may slip in some bounces and stick in others.

    If friction can reverse the slip, return None also if the relative error of the remaining slip may be larger than
    ``tolerance / 1024``. If `tolerance` is None, the error of the slip is not limited.
    """
    material = bodies.materials[bodies.obstacles[wall_index(bounce.body)].wall]
    y, e, c = bodies.inverse_inertia_ratio[i], arb(material.restitution), bodies.scene.wall_rolling_resistance
    speed = ground.tangential_part(*bodies.velocity(i, bounce.time, bodies.time[i]))
    place, rim = ground.tangential_part(*bodies.centre_at(i, bounce.time)), bodies.rim_speed(i)
    sticks, blocks = bounce.taken.sticks, bounce.taken.blocks
    gives_back = material.friction and bodies.scene.wall_tangential_restitution
    if blocks is None or (sticks is None and not gives_back):
        return None
    slip, rim = ZERO if sticks and not gives_back else speed + rim, ZERO if blocks else rim
    if bounce.leaves.is_zero():
        return GlideState(place, speed, slip, rim)
    if gives_back:
        ended = _sum_reversing_bounces(bodies, ground, material, bounce, y, GlideState(place, speed, slip, rim))
        if ended is None or tolerance is None or ended.slip.rad() <= tolerance / 1024 * abs(ended.slip):
            return ended
        return None
    normal_change, gained_speed = (1 + e) * bounce.leaves, ground.along * hop
    limits = (arb(material.friction) * normal_change, arb(c) * normal_change)
    frictions = share_frictions(slip + gained_speed, rim, limits, y) if material.friction or c else bounce.taken
    if (frictions.sticks, frictions.blocks) != (sticks, blocks):
        return None
    rim_change = (frictions.friction + frictions.rolling) * y
    change, left = gained_speed - frictions.friction, 1 - e
    slips, turns = change - rim_change, ZERO - rim_change
    free_slip, free_rim = material.friction and not sticks, c and not blocks
    for value, rate in (*([(slip, slips)] if free_slip else []), *([(rim, turns)] if free_rim else [])):
        if sign_of(value) is None or {sign_of(value + rate), sign_of(value + rate / left)} != {sign_of(value)}:
            return None
    distance = hop * ((speed + change / left) / left - (change / left - gained_speed / 2) / (1 - e * e))
    slip = ZERO if sticks else slip + slips / left
    rim = ZERO if blocks else rim + turns / left
    return GlideState(place + distance, speed + change / left, slip, rim)


def _sum_reversing_bounces(
    bodies: BallBodies, ground: BallGround, material: Material, bounce: Bounce, y: arb, state: GlideState
) -> GlideState | None:
    """Return the state after bounces in which friction may reverse the slip; None if the final slip is undecided.

    Let e be the restitution, f the coefficient of friction, b the tangential restitution, y the reciprocal of the
    inertia factor, and r the slip speed divided by the speed of approach. A bounce and the flight after it change r to
    ``(g(r) + A) / e``. A is the slip that gravity adds in this flight, divided by the speed of approach. With
    ``C = f (1 + e)(1 + y)``, g(r) is ``-b r`` up to ``|r| = C / (1 + b)``, and ``r - C`` for larger r. So r stays
    within ``R = (C - |A|) / (1 - e)`` if ``|b| C / (1 + b) + |A|`` is at most ``e R``. Then the slip and the speed of
    approach go to 0 together, whether the disc slides or sticks. The final speed u and the final rim speed q follow
    from the quantity ``y u - q``, which friction does not change.

    If ``|r|`` may be larger than R, friction can change the slip by at most a known amount in all remaining impacts. If
    the slip is larger than this change, the disc still slides at the end, and its slip is known up to this change.
    """
    (place, speed, slip, rim), hop = state, 2 * bounce.leaves / ground.presses
    e, b = arb(material.restitution), arb(bodies.scene.wall_tangential_restitution)
    c, a = arb(material.friction) * (1 + e) * (1 + y), 2 * abs(ground.along) * e / ground.presses
    max_ratio, duration_s = (c - a) / (1 - e), hop / (1 - e)
    bounded = 1 + b > 0 and c * (e * (1 + b) - abs(b) * (1 - e)) >= a * (1 + b)
    if bounded and abs(slip + ground.along * hop) <= max_ratio * bounce.leaves:
        slips, conserved = arb(0, (abs(slip) + max_ratio * bounce.leaves).upper()), y * speed - rim
        distance = duration_s * (conserved + y * ground.along * duration_s / 2 + slips) / (1 + y)
        speed = (conserved + y * ground.along * duration_s) / (1 + y)
        return GlideState(place + distance, speed, ZERO, ZERO - speed)
    friction_change, gained_speed = arb(0, (c * bounce.leaves / ((1 - e) * (1 + y))).upper()), ground.along * duration_s
    friction_change = ZERO if (1 + b).is_zero() else friction_change
    left = GlideState(
        place + duration_s * (speed + gained_speed / 2 + friction_change),
        speed + gained_speed + friction_change,
        slip + gained_speed + friction_change * (1 + y),
        rim,
    )
    return None if sign_of(left.slip) is None else left._replace(rim=rim + friction_change * y)


def meets_only_ground(bodies: BallBodies, i: int, ground: BallGround, time: arb, window: arb) -> bool:
    """Return whether disc `i` certainly meets only its surface in the duration `window` after `time`.

    The energy E of all discs bounds the speed of each disc. Impacts, friction and walls at rest do not increase E.
    Gravity g increases ``sqrt(2 E)`` by at most ``sqrt(M) g`` per second, where M is the total mass.
    """
    discs = bodies.scene.discs
    if bodies.fastest_drive:
        return False
    movable = [j for j in range(len(bodies)) if bodies.movable[j]]
    if any(bodies.inverse_inertia_ratio[j].is_zero() and discs[j].spin_rad_s for j in movable):
        return False  # friction on a disc with fixed spin can speed up other discs
    root_energy_bound = _bound_root_energy(bodies, movable, time + window)
    x, y = bodies.centre_at(i, time)
    own_reach = root_energy_bound / arb(discs[i].mass_kg).sqrt() * window
    for j, disc in enumerate(discs):
        if j == i:
            continue
        far = own_reach
        if bodies.movable[j]:
            fastest = root_energy_bound / arb(disc.mass_kg).sqrt()
            since = [(last - time).upper() for last in bodies.met[j].values()]
            late = max([ZERO, *since])  # the disc may have had an impact slightly after `time`
            far = far + fastest * (window + 2 * late) + bodies.bound_acceleration() * late * late
        ox, oy = bodies.centre_at(j, time)
        reach = arb(disc.radius_m) + arb(discs[i].radius_m) + far
        if not (ox - x) ** 2 + (oy - y) ** 2 > reach * reach:
            return False
    if ground.span is not None:
        place = ground.tangential_part(x, y)
        if not (place - own_reach > ground.span[0] and place + own_reach < ground.span[1]):
            return False
    other_obstacles = (k for k in range(len(bodies.obstacles)) if wall_body(k) not in ground.never_met)
    return all(_is_out_of_reach(bodies, i, k, (x, y), own_reach) for k in other_obstacles)


def _bound_root_energy(bodies: BallBodies, movable: Iterable[int], until: arb) -> arb:
    """Return a bound of ``sqrt(2 E)`` up to a time, where E is the energy of all discs."""
    energy = mass = ZERO
    for j in movable:
        disc = bodies.scene.discs[j]
        (u, v), rim = map(arb, disc.velocity_m_s), arb(disc.radius_m) * disc.spin_rad_s
        turning = ZERO if rim.is_zero() else rim * rim / bodies.inverse_inertia_ratio[j]
        energy, mass = energy + arb(disc.mass_kg) * (u * u + v * v + turning), mass + arb(disc.mass_kg)
    gx, gy = bodies.gravity
    return energy.sqrt() + mass.sqrt() * (gx * gx + gy * gy).sqrt() * until


def _is_out_of_reach(bodies: BallBodies, i: int, k: int, place: tuple[arb, arb], far: arb) -> bool:
    """Return whether the distance of disc `i` from part k of the walls is certainly greater than `far`."""
    (x, y), radius = place, bodies.scene.discs[i].radius_m
    shape = bodies.obstacles[k].shape
    if isinstance(shape, Round):
        circle = bodies.laws.of_round(k, radius)
        distance = ((x - circle.cx) ** 2 + (y - circle.cy) ** 2).sqrt()
        return bool(distance + far < circle.reach if shape.inside else distance > circle.reach + far)
    law = bodies.laws.of_straight(k, radius)
    if x * law.nx + y * law.ny - law.level > far * law.length:
        return True
    if shape.stretch is None:
        return False
    (ax, ay), (bx, by) = (map(ball, point) for point in shape.stretch)
    half = ((ax - bx) ** 2 + (ay - by) ** 2).sqrt() / 2
    thick = (law.level - (law.nx * ax + law.ny * ay)) / law.length
    if abs(law.nx * (x - ax) + law.ny * (y - ay)) > (thick + far) * law.length:  # the disc is clearly on the far side
        return True
    return bool(((2 * x - ax - bx) ** 2 + (2 * y - ay - by) ** 2).sqrt() / 2 > half + thick + far)
