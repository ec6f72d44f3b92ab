"""Contact in certified runs: discs that slide, roll and rest on straight walls below them.

The module is a copy of `core/wall_contact_law.h` and `core/pic/lasting_contact.h` in interval arithmetic. A quantity
that the contact law makes 0 is stored as exactly 0. The state of a disc in contact is relative to the disc's wall. The
contact determines the disc's acceleration. Before an impact, a disc is released from its wall. After the impact, the
disc returns to the wall or stays free.

Bounces are applied one by one until the duration of all remaining bounces is less than the requested accuracy of times.
The remaining bounces are summed as a geometric series. The geometric series can be summed if the disc certainly slips
in one direction in all remaining bounces, or certainly sticks in all of them. If friction can reverse the slip, other
conditions apply (`carom.solvers.certified.landing`).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from flint import arb

from carom.core.resolution import gap_resolution, size_of
from carom.core.wall_parts import Plane
from carom.model.trace import EdgeKind, Mode, wall_body, wall_index
from carom.solvers.certified.ball_arithmetic import ZERO, BallVector, ball, float_above, float_below
from carom.solvers.certified.contact_state import BallGround, BallMode, End, GlideState, Gliding, Landing, Launch
from carom.solvers.certified.disc_states import BallBodies
from carom.solvers.certified.landing import meets_only_ground, sum_bounces
from carom.solvers.certified.meeting import Meeting, WallApproach
from carom.solvers.certified.result import Degeneracy, Degenerate, Undecided
from carom.solvers.certified.sign_changes import find_falls
from carom.solvers.certified.two_frictions import share_frictions, sign_of

# Future events ----------------------------------------------------------------------------------------------------


def meet_end(bodies: BallBodies, i: int, instant_s: float) -> Meeting | None:
    """Return the next change of disc `i` without an impact (see `ContactStates.end_of`); None if it never changes."""
    time = bodies.contacts.end_of(i)
    if time is None:
        return None
    return Meeting(i, i, max(instant_s, min(float_below(time), float_above(time))), time, float_above(time))


def gap_on_same_ground(bodies: BallBodies, i: int, j: int, instant_s: float, reach: arb) -> list[arb] | None:
    """Return the gap of two discs as a polynomial of time since `instant_s`; None if they are not on one surface."""
    one, other = bodies.contacts.gliding[i], bodies.contacts.gliding[j]
    if one is None or other is None or one.ground.body != other.ground.body:
        return None
    ground = one.ground
    kinds = [(bodies.scene.discs[k].inertia_factor, g.branch) for k, g in ((i, one), (j, other))]
    rate = ZERO if kinds[0] == kinds[1] else other.rate - one.rate
    (xi, yi), (xj, yj) = bodies.centre(i, instant_s), bodies.centre(j, instant_s)
    (ui, vi), (uj, vj) = (bodies.velocity(k, arb(instant_s), instant_s) for k in (i, j))
    offset, speed = ground.tangential_part(xj - xi, yj - yi), ground.tangential_part(uj - ui, vj - vi)
    radii = [arb(bodies.scene.discs[k].radius_m) for k in (i, j)]
    along = reach if (radii[0] - radii[1]).is_zero() else 2 * (radii[0] * radii[1]).sqrt()
    side = 1 if offset > 0 else -1
    return [side * offset - along, side * speed, side * rate / 2]


# The start ------------------------------------------------------------------------------------------------------------


def find_resting(bodies: BallBodies) -> Iterator[tuple[int, BallGround]]:
    """Yield each disc that touches a surface below it at the start, apart from rounding, and this surface."""
    for i, disc in enumerate(bodies.scene.discs):
        for k in range(len(bodies.obstacles)) if bodies.movable[i] else ():
            ground = ground_of(bodies, i, k)
            if ground is None:
                continue
            centre, max_gap = (bodies.x[i], bodies.y[i]), _compute_gap_resolution(bodies, i, k)
            gap, place = ground.normal_part(*centre) - ground.level, ground.tangential_part(*centre)
            is_beyond_end = ground.span and not ground.span[0] < place < ground.span[1]
            normal_speed = ground.normal_part(bodies.vx[i], bodies.vy[i])
            slow = normal_speed * normal_speed <= 2 * ground.presses * max_gap
            if not is_beyond_end and -arb(disc.radius_m) < gap <= max_gap and (slow or normal_speed < 0):
                yield i, ground
                break


def begin_contact(bodies: BallBodies, i: int, ground: BallGround) -> BallMode | Meeting:
    """Start the contact of disc `i` with a surface, or return an impact if the disc moves towards the surface."""
    k = wall_index(ground.body)
    place = ground.tangential_part(bodies.x[i], bodies.y[i])
    speed = ground.tangential_part(bodies.vx[i], bodies.vy[i])
    normal_speed, rim = ground.normal_part(bodies.vx[i], bodies.vy[i]), bodies.rim_speed(i)
    bodies.x[i], bodies.y[i] = ground.centre_at(place)
    if normal_speed * normal_speed <= 2 * ground.presses * _compute_gap_resolution(bodies, i, k):
        return start_mode(bodies, i, Landing(ZERO, ground, GlideState(place, speed, speed + rim, rim)), 0.0)
    near = WallApproach((ZERO - normal_speed) * bodies.laws.of_straight(k, bodies.scene.discs[i].radius_m).length, ZERO)
    return Meeting(i, ground.body, 0.0, ZERO, 0.0, near=near)


def _compute_gap_resolution(bodies: BallBodies, i: int, k: int) -> arb:
    """Return the rounding error of the gap between disc `i` and a straight surface k at the start."""
    disc, shape = bodies.scene.discs[i], bodies.obstacles[k].shape
    point = shape.point if isinstance(shape, Plane) else (0, 0)
    sizes = size_of(*disc.position_m, disc.radius_m) + size_of(float(point[0]), float(point[1]), 0.0)
    return arb(gap_resolution(sizes))


# Modes ----------------------------------------------------------------------------------------------------------------


def end_mode(bodies: BallBodies, meeting: Meeting) -> BallMode:
    """Let a disc change from sliding, rolling or rest to its next motion."""
    i, instant_s = meeting.first, meeting.at
    gliding, landing = bodies.contacts.gliding[i], bodies.contacts.landings[i]
    if landing is not None:
        return start_mode(bodies, i, landing, instant_s)
    if gliding is None or gliding.end is None:
        raise TypeError(f"the mode of disc {i} does not end")
    end, state = gliding.end, gliding.state_after(gliding.end.wait)
    if end.undecided:
        raise _undecided(bodies, Degenerate.MODE, i, gliding.ground, end.time)
    if end.over:
        return _leave_face(bodies, i, gliding, state, instant_s)
    slip, rim = (ZERO if zero else value for zero, value in ((end.slip, state.slip), (end.rim, state.rim)))
    begun = Landing(end.time, gliding.ground, state._replace(slip=slip, rim=rim))
    return start_mode(bodies, i, begun, instant_s, gliding.mode)


def restore_contact(
    bodies: BallBodies, i: int, in_contact: Mapping[int, Gliding], meeting: Meeting, normal: tuple[arb, arb]
) -> BallMode | None:
    """Return disc `i` to its wall after an impact, or let it leave the wall.

    Return the change between sliding, rolling, rest and flight; None if nothing changes.

    Raises:
        Undecided: The disc is pushed into its wall, so that the result is not unique, or the precision is too low
            for a decision.
    """
    before = in_contact[i]
    ground, time, instant_s = before.ground, meeting.time, meeting.at
    x, y = bodies.centre_at(i, time)
    vx, vy = bodies.velocity(i, time, instant_s)
    if not _keeps_normal_speed(bodies, i, in_contact, meeting, normal):
        normal_speed = ground.normal_part(vx, vy)
        if normal_speed > 0:
            return _describe_change(bodies, i, ground, time, instant_s, before.mode, Mode.FLIGHT)
        other_bodies = (body for body in (meeting.first, meeting.second) if body != i)
        pushed = bool(normal_speed < 0)
        raise _undecided(bodies, Degenerate.RESTING_CONTACT, i, ground, time, *other_bodies, proven=pushed)
    rim = bodies.rim_speed(i)
    speed = ground.tangential_part(vx, vy)
    state = GlideState(ground.tangential_part(x, y), speed, speed + rim, rim)
    settled = start_mode(bodies, i, Landing(time, ground, state), instant_s, before.mode)
    gliding = bodies.contacts.gliding[i]
    is_same_mode = gliding is not None and gliding.mode is before.mode and gliding.rate.overlaps(before.rate)
    return None if is_same_mode and gliding is not None and gliding.rim_rate.overlaps(before.rim_rate) else settled


def _keeps_normal_speed(
    bodies: BallBodies, i: int, in_contact: Mapping[int, Gliding], meeting: Meeting, normal: tuple[arb, arb]
) -> bool:
    """Return whether an impact certainly doesn't change the speed of disc `i` perpendicular to its surface."""
    ground, other = in_contact[i].ground, meeting.second if meeting.first == i else meeting.first
    if other < 0:
        rubs = bodies.materials[bodies.obstacles[wall_index(other)].wall].friction > 0.0
        flat = isinstance(bodies.obstacles[wall_index(other)].shape, Plane)
        return flat and not rubs and bodies.are_orthogonal(other, ground.body)
    if bodies.scene.arrays.has_disc_friction:
        return False
    is_on_same_ground = other in in_contact and in_contact[other].ground.body == ground.body
    alike = bodies.scene.discs[i].radius_m == bodies.scene.discs[other].radius_m
    return (alike and is_on_same_ground) or ground.normal_part(*normal).is_zero()


def release_struck(bodies: BallBodies, discs: list[int], time: arb, instant_s: float) -> dict[int, Gliding]:
    """Release the discs of an impact from their walls. Return the contacts of the released discs by disc number.

    The new path of a disc is the tangent of the old path, in the reference frame that falls with gravity.
    """
    before = {i: gliding for i in discs if (gliding := bodies.contacts.gliding[i]) is not None}
    for i in discs:
        if bodies.acceleration[i] is not None:
            velocity, spin = bodies.velocity(i, time, instant_s), bodies.spin_at(i, time)
            _set_flight(bodies, i, bodies.centre_at(i, time), velocity, spin, time, instant_s)
    for i in discs:
        bodies.contacts.clear(i)
    return before


def start_mode(bodies: BallBodies, i: int, landing: Landing, instant_s: float, before: Mode = Mode.FLIGHT) -> BallMode:
    """Let disc `i` slide, roll or rest on a surface, from a given time and state on."""
    time, ground, (place, speed, slip, rim) = landing
    material = bodies.materials[bodies.obstacles[wall_index(ground.body)].wall]
    bodies.contacts.clear(i)
    y = bodies.inverse_inertia_ratio[i]
    c = ZERO if y.is_zero() else arb(bodies.scene.wall_rolling_resistance)
    limits = (arb(material.friction) * ground.presses, c * ground.presses)
    resists = not c.is_zero()
    if resists and slip.is_zero():  # rolling: speed and rim speed are exactly opposite
        speed = ZERO if rim.is_zero() else speed
        rim = ZERO - speed
    signs = sign_of(slip), sign_of(rim) if resists else 0
    frictions = None if None in signs else share_frictions(ground.along, ZERO, limits, y, signs)  # type: ignore[arg-type]
    if frictions is None or frictions.sticks is None or frictions.blocks is None:
        raise _undecided(bodies, Degenerate.MODE, i, ground, time)
    turns = ZERO if frictions.blocks else ZERO - (frictions.friction + frictions.rolling) * y
    rate = ZERO - turns if frictions.sticks else ground.along - frictions.friction
    if frictions.sticks:
        slip = ZERO
        speed, rim = (ZERO - rim, rim) if y.is_zero() else (speed, ZERO - speed)
        mode = Mode.REST if speed.is_zero() and rate.is_zero() else Mode.ROLL
    else:
        mode = Mode.BLOCK if frictions.blocks else Mode.SLIDE
    slides = 0 if frictions.sticks else sign_of(frictions.friction) or 0
    rolls = 0 if frictions.blocks else sign_of(frictions.rolling) or 0
    branch = (slides, rolls, frictions.sticks, frictions.blocks)
    gliding = Gliding(time, ground, mode, GlideState(place, speed, slip, rim), rate, turns, branch)
    bodies.contacts.gliding[i] = gliding._replace(end=_find_end(bodies, i, gliding, resists=resists))
    bodies.contacts.barred[i] = ground.never_met
    _set_path(bodies, i, instant_s)
    return _describe_change(bodies, i, ground, time, instant_s, before, mode)


def _set_path(bodies: BallBodies, i: int, instant_s: float) -> None:
    """Let disc `i` move with the acceleration that its contact causes."""
    gliding, radius = bodies.contacts.gliding[i], arb(bodies.scene.discs[i].radius_m)
    assert gliding is not None  # noqa: S101 - the caller has just set it
    ground, (place, speed, _, rim), rate = gliding.ground, gliding.begun, gliding.rate
    wait = gliding.since - arb(instant_s)
    (ax, ay), (vx, vy) = ground.vector_along(rate), ground.vector_along(speed)
    x, y = ground.centre_at(place)
    bodies.acceleration[i], bodies.spin_rate[i] = (ax, ay), gliding.rim_rate / radius
    bodies.x[i], bodies.y[i] = x - wait * (vx - ax * wait / 2), y - wait * (vy - ay * wait / 2)
    bodies.vx[i], bodies.vy[i] = vx - ax * wait, vy - ay * wait
    bodies.spin[i] = rim / radius - bodies.spin_rate[i] * wait
    bodies.record_impact(i, ground.body, instant_s, gliding.since, float_above(gliding.since))


def _find_end(bodies: BallBodies, i: int, gliding: Gliding, *, resists: bool) -> End | None:
    """Return when a disc first stops sliding, rolling or resting without an impact; None if it never stops."""
    (_, speed, slip, rim), slips = gliding.begun, gliding.rate + gliding.rim_rate
    turns_only = speed.is_zero() and gliding.rate.is_zero()  # slip equals rim speed, so both end at once
    causes = [(slip, slips, End(ZERO, ZERO, slip=True, rim=turns_only))]
    if resists and not turns_only:
        causes.append((rim, gliding.rim_rate, End(ZERO, ZERO, rim=True)))
    possible_ends = []
    for value, rate, ends in causes:
        if value.is_zero():
            continue
        toward = value * rate
        if toward < 0:
            possible_ends.append(ends._replace(wait=ZERO - value / rate, slip=ends.slip or gliding.branch[2]))
        elif not toward >= 0:
            raise _undecided(bodies, Degenerate.MODE, i, gliding.ground, gliding.since)
    if (span := gliding.ground.span) is not None:
        place, half = gliding.begun.place, gliding.rate / 2
        ways = [place - span[0], speed, half], [span[1] - place, ZERO - speed, ZERO - half]
        falls = (next(find_falls(powers), None) for powers in ways)
        possible_ends += (End(fall.time, ZERO, over=True, undecided=not fall.certain) for fall in falls if fall)
    first = [end for end in possible_ends if not any(other.wait < end.wait for other in possible_ends)]
    if not first:
        return None
    end = first[0]
    for other in first[1:]:  # this precision does not show which end comes first
        end = end._replace(wait=end.wait.union(other.wait), undecided=True)
    return end._replace(time=gliding.since + end.wait)


def _leave_face(bodies: BallBodies, i: int, gliding: Gliding, state: GlideState, instant_s: float) -> BallMode:
    """Let disc `i`, which has reached an end of its surface, fly off if it is fast enough to leave the surface."""
    ground, end = gliding.ground, gliding.end
    assert end is not None and ground.span is not None  # noqa: S101, PT018 - the disc is at the end of a face
    obstacle = bodies.obstacles[wall_index(ground.body)]
    last = bool(2 * state.place > ground.span[0] + ground.span[1])
    place = ground.span[last]
    assert isinstance(obstacle.shape, Plane) and obstacle.shape.stretch is not None  # noqa: S101, PT018 - as above
    begin = ground.tangential_part(*map(ball, obstacle.shape.stretch.begin))
    vertex = obstacle.neighbours[not place.overlaps(begin)]
    if bodies.obstacles[wall_index(vertex)].kind is not EdgeKind.VERTEX:
        raise _undecided(bodies, Degenerate.EDGE, i, ground, end.time, proven=True)
    a, p, u = ground.along, ground.presses, state.speed
    reach = bodies.laws.of_round(wall_index(vertex), bodies.scene.discs[i].radius_m).reach
    powers = (u * u - p * reach, a * u, (a * a + p * p) / 4)
    if not powers[0] > 0:
        raise _undecided(bodies, Degenerate.EDGE, i, ground, end.time, proven=bool(powers[0] < 0))
    velocity = ground.vector_along(u)
    spin = state.rim / arb(bodies.scene.discs[i].radius_m)
    bodies.contacts.clear(i)
    _set_flight(bodies, i, ground.centre_at(place), velocity, spin, end.time, instant_s)
    bodies.record_impact(i, vertex, instant_s, end.time, float_above(end.time))
    bodies.contacts.launched[i] = Launch(vertex, end.time, powers)
    bodies.contacts.barred[i] = ground.never_met - {vertex}
    return _describe_change(bodies, i, ground, end.time, instant_s, gliding.mode, Mode.FLIGHT)


def _set_flight(
    bodies: BallBodies, i: int, place: BallVector, velocity: BallVector, spin: arb, time: arb, instant_s: float
) -> None:
    (gx, gy), wait = bodies.gravity, time - arb(instant_s)
    half_square = time * time / 2
    bodies.acceleration[i], bodies.spin_rate[i], bodies.spin[i] = None, ZERO, spin
    bodies.vx[i], bodies.vy[i] = velocity[0] - gx * time, velocity[1] - gy * time
    bodies.x[i] = place[0] - gx * half_square - bodies.vx[i] * wait
    bodies.y[i] = place[1] - gy * half_square - bodies.vy[i] * wait
    bodies.time[i] = instant_s


def _describe_change(
    bodies: BallBodies, i: int, ground: BallGround, time: arb, instant_s: float, before: Mode, after: Mode
) -> BallMode:
    moves = (bodies.centre_at(i, time), bodies.velocity(i, time, instant_s), bodies.acceleration_of(i))
    wall = bodies.trace_body(ground.body)
    return BallMode(time, i, wall, before, after, *moves, bodies.spin_at(i, time), bodies.spin_rate[i])


def _undecided(
    bodies: BallBodies, kind: Degenerate, i: int, ground: BallGround, time: arb, *others: int, proven: bool = False
) -> Undecided:
    involved = tuple(sorted({i, bodies.trace_body(ground.body), *map(bodies.trace_body, others)}))
    earliest_s, bits = max(0.0, float_below(time)), bodies.state_bits(i)
    return Undecided(Degeneracy(kind, involved, earliest_s, float_above(time), proven, bits))


# The end of bounces ---------------------------------------------------------------------------------------------------


def record_landing(bodies: BallBodies, i: int, tolerance: arb | None) -> bool:
    """Record when and where the bounces of disc `i` end, by summing its remaining bounces.

    The duration of the remaining bounces must be at most `tolerance` times the instant of the last impact. If
    `tolerance` is None, neither this duration nor other events are checked, because both checks were done before.

    Return False if it is undecided whether the disc slips or sticks in the bounces, or if another event may come
    before their end.
    """
    bounce = bodies.contacts.bounces[i]
    if bounce is None or bodies.contacts.gliding[i] is not None or bodies.contacts.landings[i] is not None:
        return False
    k = wall_index(bounce.body)
    ground, material = ground_of(bodies, i, k), bodies.materials[bodies.obstacles[k].wall]
    if ground is None or not material.restitution < 1.0:
        return False
    hop = 2 * bounce.leaves / ground.presses
    window = hop / (1 - arb(material.restitution))
    if tolerance is not None and not window <= tolerance * bounce.time:
        return False
    state = sum_bounces(bodies, i, ground, bounce, hop, tolerance)
    known = tolerance is None or window.is_zero()  # whether no other event can come before the end of the bounces
    if state is None or not (known or meets_only_ground(bodies, i, ground, bounce.time, window)):
        return False
    bodies.contacts.landings[i] = Landing(bounce.time + window, ground, state)
    bodies.contacts.barred[i] = ground.never_met
    return True


def ground_of(bodies: BallBodies, i: int, k: int) -> BallGround | None:
    """Return part k of the walls as a surface for disc `i`; None unless it is straight, at rest and below the disc."""
    obstacle = bodies.obstacles[k]
    shape, belts = obstacle.shape, bodies.scene.arrays.belts_m_s
    if not isinstance(shape, Plane) or bodies.pulls[k] >= 0 or bodies.is_driven(k):
        return None
    if belts and belts[obstacle.wall]:
        return None
    law, (gx, gy) = bodies.laws.of_straight(k, bodies.scene.discs[i].radius_m), bodies.gravity
    nx, ny, level = law.nx, law.ny, law.level / law.length
    presses, along = (ZERO - gx * nx - gy * ny) / law.length, (gx * ny - gy * nx) / law.length
    span = None
    if shape.stretch is not None:
        ends = [map(ball, point) for point in shape.stretch]
        one, other = ((x * ny - y * nx) / law.length for x, y in ends)
        span = (one, other) if one < other else (other, one)
    return BallGround(wall_body(k), nx, ny, law.length, level, presses, along, span, obstacle.never_met)
