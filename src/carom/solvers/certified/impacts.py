"""Effect of an impact on discs, in interval arithmetic.

Two kinds of impacts are linear in the state: impacts on walls, and impacts of two discs along an axis. Linear formulas
are used for these two kinds of impacts, because errors do not grow in linear formulas. Friction is added afterwards. If
it is undecided whether discs stick or slide, the resulting intervals include both cases. The state after an impact is
stored for the instant `Meeting.at` just before the impact, by extending the new path backwards.
"""

from __future__ import annotations

from typing import NamedTuple

from flint import arb

from carom.model.trace import NO_EDGE, wall_index
from carom.solvers.certified.ball_arithmetic import ZERO
from carom.solvers.certified.contact_state import BallMode, Bounce
from carom.solvers.certified.contacts import end_mode, release_struck, restore_contact
from carom.solvers.certified.disc_states import BallBodies
from carom.solvers.certified.laws import PairLaw
from carom.solvers.certified.meeting import Meeting, PairApproach, RoundApproach, Seam, WallApproach
from carom.solvers.certified.slowing import start_deceleration, stop_disc
from carom.solvers.certified.two_frictions import BallFrictions, limit_sticking, share_frictions


class BallImpact(NamedTuple):
    """A certified impact: its time, its normal (of any length), and the velocities and spins after the impact.

    `before` contains the velocities just before the impact. `before` is None if no velocity has changed since the
    previous impact. `second` is the second body's number in traces. `edge` is the part of a finite wall that the disc
    hit.
    """

    first: int
    second: int
    time: arb
    nx: arb
    ny: arb
    length: arb
    after: tuple[arb, arb, arb, arb]
    before: tuple[arb, arb, arb, arb] | None = None
    spins_after: tuple[arb, arb] = (ZERO, ZERO)
    edge: tuple[int, int] = NO_EDGE
    spins_before: tuple[arb, arb] = (ZERO, ZERO)


class BallEvent(NamedTuple):
    """An impact, or changes of discs between flight, sliding, rolling and rest, or both."""

    impact: BallImpact | None
    modes: tuple[BallMode, ...] = ()


def apply_meeting(bodies: BallBodies, meeting: Meeting) -> BallEvent:
    """Apply an impact that certainly happens, and return the event.

    Raises:
        Undecided: With this precision it is unknown whether the disc stays in contact after the impact.
    """
    first, second = meeting[:2]
    if first == second:
        if bodies.contacts.stops[first] is not None:
            stop_disc(bodies, meeting)
            return BallEvent(None)
        return BallEvent(None, (end_mode(bodies, meeting),))
    discs = [body for body in (first, second) if body >= 0 and bodies.movable[body]]
    curved = any(bodies.acceleration[i] is not None for i in discs)
    in_contact = release_struck(bodies, discs, meeting.time, meeting.at)
    if curved and isinstance(meeting.near, PairApproach):
        meeting = meeting._replace(near=_replace_by_tangents(bodies, meeting, meeting.near))
    spins = (bodies.spin[first], bodies.spin[second] if second >= 0 else ZERO)
    impact = _apply_impact(bodies, meeting)._replace(spins_before=spins)
    normal = (impact.nx, impact.ny)
    modes = [restore_contact(bodies, i, in_contact, meeting, normal) for i in in_contact]
    for i in discs if bodies.scene.table_deceleration_m_s2 else ():
        start_deceleration(bodies, i, meeting.time, meeting.at)
    return BallEvent(impact, tuple(mode for mode in modes if mode is not None))


def _replace_by_tangents(bodies: BallBodies, meeting: Meeting, near: PairApproach) -> PairApproach:
    """Return the states of two discs before their impact, with tangents at the impact instead of curved paths."""
    wait, places, speeds = near.wait, [], []
    for i in meeting[:2]:
        u, v = bodies.velocity(i, meeting.time, meeting.at)
        if bodies.movable[i]:
            places.append(bodies.centre_at(i, meeting.time))
        else:
            x, y = bodies.centre_in_frame(i, meeting.at)
            places.append((x + u * wait, y + v * wait))
        speeds.append((u, v))
    ux, uy = speeds[1][0] - speeds[0][0], speeds[1][1] - speeds[0][1]
    dx, dy = places[1][0] - places[0][0] - ux * wait, places[1][1] - places[0][1] - uy * wait
    alike = bodies.movable[meeting.first] and bodies.movable[meeting.second]
    (xi, yi), (xj, yj) = (bodies.centre_in_frame(i, meeting.at) for i in meeting[:2])
    return PairApproach(xi, yi, xj, yj, dx, dy, ux, uy, near.root, wait, None if alike else (ZERO, ZERO))


def _apply_impact(bodies: BallBodies, meeting: Meeting) -> BallImpact:
    if isinstance(meeting.near, Seam):
        return _apply_impact_at_joint(bodies, meeting, meeting.near)
    scene = bodies.scene
    changing = bodies.falls or bodies.fastest_drive or scene.damping_per_s or scene.table_deceleration_m_s2
    before = _list_velocities(bodies, meeting) if changing else None
    edge = NO_EDGE
    if isinstance(meeting.near, PairApproach):
        normal = _collide_discs(bodies, meeting, meeting.near)
        if bodies.scene.arrays.has_disc_friction:
            _rub_discs(bodies, meeting, meeting.near, normal)
    else:
        edge = _find_edge(bodies, meeting)
        vx, vy, ux, uy = _list_velocities(bodies, meeting)
        normal = _bounce_off_straight(bodies, meeting, meeting.near)
        rubbed = _rub_wall(bodies, meeting, (vx - ux, vy - uy), normal)
        if isinstance(meeting.near, WallApproach):
            leaves = _find_restitution(bodies, meeting) * meeting.near.root / normal[2]
            bodies.contacts.bounces[meeting.first] = Bounce(meeting.time, meeting.second, leaves, rubbed)
    first, second, instant_s, time, latest = meeting[:5]
    for disc, other in ((first, second), (second, first)):
        if disc >= 0 and bodies.movable[disc]:
            bodies.record_impact(disc, other, instant_s, time, latest)
    spins = (bodies.spin[first], bodies.spin[second] if second >= 0 else ZERO)
    body = bodies.trace_body(second)
    return BallImpact(first, body, time, *normal, _list_velocities(bodies, meeting), before, spins, edge)


def _apply_impact_at_joint(bodies: BallBodies, meeting: Meeting, seam: Seam) -> BallImpact:
    """Apply an impact near the smooth joint of two edges of a wall.

    It is undecided which edge the disc meets. So the intervals of the disc's new state include the results for both
    edges.
    """
    i, states = meeting.first, (bodies.x, bodies.y, bodies.vx, bodies.vy, bodies.spin)
    state_before, time = [state[i] for state in states], bodies.time[i]
    other = _apply_impact(bodies, seam.other)
    after_other = [state[i] for state in states]
    for state, value in zip(states, state_before, strict=True):
        state[i] = value
    bodies.time[i] = time
    one = _apply_impact(bodies, seam.one)
    bodies.contacts.bounces[i] = None  # it is undecided which edge the disc has met
    for state, value in zip(states, after_other, strict=True):
        state[i] = state[i].union(value)
    nx = (one.nx / one.length).union(other.nx / other.length)
    ny = (one.ny / one.length).union(other.ny / other.length)
    after, spins = _list_velocities(bodies, meeting), (bodies.spin[i], ZERO)
    return one._replace(time=meeting.time, nx=nx, ny=ny, length=arb(1), after=after, spins_after=spins)


def _find_edge(bodies: BallBodies, meeting: Meeting) -> tuple[int, int]:
    """Return the number and kind of the edge of a finite wall that the disc has hit.

    If a part of a wall consists of several edges, the disc's position determines the edge.
    """
    obstacle = bodies.obstacles[wall_index(meeting.second)]
    if obstacle.kind is None:
        return NO_EDGE
    if len(obstacle.edges) == 1:
        return obstacle.edges[0], obstacle.kind
    outline = bodies.scene.arrays.walls[obstacle.wall]
    assert not isinstance(outline, tuple)  # noqa: S101 - for mypy
    leg = bodies.legs_after(meeting.second, meeting.at)[0]
    x, y, *_ = bodies.relative_state(meeting.first, float(meeting.time), leg)
    return outline.find_edge(float(x), float(y), obstacle.edges), obstacle.kind


def _list_velocities(bodies: BallBodies, meeting: Meeting) -> tuple[arb, arb, arb, arb]:
    first, second, instant_s, time = meeting.first, meeting.second, meeting.at, meeting.time
    if second >= 0:
        return *bodies.velocity(first, time, instant_s), *bodies.velocity(second, time, instant_s)
    leg = bodies.legs_after(second, instant_s)[0]
    return *bodies.velocity(first, time, instant_s), *((ZERO, ZERO) if leg is None else (leg.vx, leg.vy))


def _collide_discs(bodies: BallBodies, meeting: Meeting, near: PairApproach) -> tuple[arb, arb, arb]:
    """Apply the impact of two discs, whose distance R and relative normal speed ``-sqrt(D) / R`` are already known."""
    i, j = meeting.first, meeting.second
    law = bodies.laws.of_discs(i, j)
    (_, _, vxi, vyi), (_, _, vxj, vyj) = bodies.state_in_frame(i, meeting.at), bodies.state_in_frame(j, meeting.at)
    xi, yi, xj, yj = near.xi, near.yi, near.xj, near.yj
    straight = near.pull is None
    if straight and near.dy.is_zero() and near.uy.is_zero():
        nx, ny = (law.reach if near.dx > 0 else ZERO - law.reach), ZERO
        vxi, vxj, xi, xj = _exchange(law, vxi, vxj, xi, xj, nx)
    elif straight and near.dx.is_zero() and near.ux.is_zero():
        nx, ny = ZERO, (law.reach if near.dy > 0 else ZERO - law.reach)
        vyi, vyj, yi, yj = _exchange(law, vyi, vyj, yi, yj, ny)
    else:
        nx, ny = near.offset()
        change_i, change_j = law.change_i * near.root, law.change_j * near.root
        px, py, qx, qy = change_i * nx, change_i * ny, change_j * nx, change_j * ny
        vxi, vyi, xi, yi = vxi - px, vyi - py, xi + px * near.wait, yi + py * near.wait
        vxj, vyj, xj, yj = vxj + qx, vyj + qy, xj - qx * near.wait, yj - qy * near.wait
    for disc, x, y, vx, vy in ((i, xi, yi, vxi, vyi), (j, xj, yj, vxj, vyj)):
        if bodies.movable[disc]:
            bodies.x[disc], bodies.y[disc], bodies.vx[disc], bodies.vy[disc] = x, y, vx, vy
    return nx, ny, law.reach


def _exchange(law: PairLaw, vi: arb, vj: arb, xi: arb, xj: arb, contact: arb) -> tuple[arb, arb, arb, arb]:
    """Return velocities and positions after an impact along one axis, as weighted means of the values before it.

    In a weighted mean, the errors hardly grow. The gap depends on the position x, so the formula ``x + share * gap``
    would add the error of x twice.
    """
    return (
        law.keep_i * vi + law.share_i * vj,
        law.keep_j * vj + law.share_j * vi,
        law.keep_i * xi + law.share_i * (xj - contact),
        law.keep_j * xj + law.share_j * (xi + contact),
    )


def _bounce_off_straight(
    bodies: BallBodies, meeting: Meeting, near: WallApproach | RoundApproach | None
) -> tuple[arb, arb, arb]:
    """Apply the impact of a disc on a straight wall. The formulas are linear if gravity has no normal component."""
    i = meeting.first
    if isinstance(near, RoundApproach):
        return _bounce_off_round(bodies, meeting, near)
    law = bodies.laws.of_straight(wall_index(meeting.second), bodies.scene.discs[i].radius_m)
    leg = bodies.legs_after(meeting.second, meeting.at)[0]
    x, y, vx, vy = bodies.subtract_leg(
        leg, meeting.at, *bodies.centre_in_frame(i, meeting.at), bodies.vx[i], bodies.vy[i]
    )
    if near is not None:  # the disc arrives with the speed ``root / |n|``
        change = (_find_restitution(bodies, meeting) + 1) * near.root / (law.length * law.length)
        px, py = change * law.nx, change * law.ny
        x, y, vx, vy = x - px * near.wait, y - py * near.wait, vx + px, vy + py
    elif not law.m_xy.is_zero():
        x, y = law.m_xx * x + law.m_xy * y + law.shift_x, law.m_xy * x + law.m_yy * y + law.shift_y
        vx, vy = law.m_xx * vx + law.m_xy * vy, law.m_xy * vx + law.m_yy * vy
    elif law.ny.is_zero():  # do not multiply by exactly 1, because the multiplication would round
        x, vx = law.m_xx * x + law.shift_x, law.m_xx * vx
    else:
        y, vy = law.m_yy * y + law.shift_y, law.m_yy * vy
    if leg is not None:
        moved_x, moved_y = leg.moved_at(arb(meeting.at))
        x, y, vx, vy = x + moved_x, y + moved_y, vx + leg.vx, vy + leg.vy
    bodies.x[i], bodies.y[i], bodies.vx[i], bodies.vy[i] = x, y, vx, vy
    return ZERO - law.nx, ZERO - law.ny, law.length


def _bounce_off_round(bodies: BallBodies, meeting: Meeting, near: RoundApproach) -> tuple[arb, arb, arb]:
    """Apply the impact of a disc on a vertex or an arc. The speed of approach is ``root / reach``."""
    i = meeting.first
    x, y = bodies.centre_in_frame(i, meeting.at)
    change = near.law.change * near.root
    dvx, dvy = change * near.px, change * near.py
    bodies.x[i], bodies.y[i] = x - dvx * near.wait, y - dvy * near.wait
    bodies.vx[i], bodies.vy[i] = bodies.vx[i] + dvx, bodies.vy[i] + dvy
    px, py = (near.px, near.py) if near.law.change < 0 else (ZERO - near.px, ZERO - near.py)
    return px, py, near.law.reach


def _find_restitution(bodies: BallBodies, meeting: Meeting) -> arb:
    return arb(bodies.materials[bodies.obstacles[wall_index(meeting.second)].wall].restitution)


def _rub_discs(bodies: BallBodies, meeting: Meeting, near: PairApproach, normal: tuple[arb, arb, arb]) -> None:
    """Apply friction to two discs at contact, as `pair_tangential_impulse` of `core/impact_law.h` does."""
    i, j = meeting.first, meeting.second
    nx, ny, reach = normal
    law, scene = bodies.laws.of_discs(i, j), bodies.scene
    w_i, w_j = bodies.inverse_mass[i], bodies.inverse_mass[j]
    slip = near.slip() + reach * (bodies.rim_speed(i) + bodies.rim_speed(j))
    inverse_effective_mass = (
        w_i * (1 + bodies.inverse_inertia_ratio[i]) + w_j * (1 + bodies.inverse_inertia_ratio[j])
    ) * law.reach2
    scaled_impulse = (arb(scene.restitution) + 1) * near.root / ((w_i + w_j) * law.reach2)
    sticking = (arb(scene.tangential_restitution) + 1) * slip / inverse_effective_mass
    tangential = limit_sticking(sticking, arb(scene.friction) * scaled_impulse).friction
    _change_velocity(bodies, i, tangential * w_i * ny, ZERO - tangential * w_i * nx, near.wait)
    _change_velocity(bodies, j, ZERO - tangential * w_j * ny, tangential * w_j * nx, near.wait)
    bodies.apply_spin_impulse(i, tangential * reach * w_i)
    bodies.apply_spin_impulse(j, tangential * reach * w_j)


def _rub_wall(
    bodies: BallBodies, meeting: Meeting, velocity: tuple[arb, arb], normal: tuple[arb, arb, arb]
) -> BallFrictions:
    """Apply a wall's friction and rolling resistance to a disc.

    Return the impulses of friction and rolling resistance per unit of mass.
    """
    i, near = meeting.first, meeting.near
    wall = bodies.obstacles[wall_index(meeting.second)].wall
    material = bodies.materials[wall]
    rolling = bodies.scene.wall_rolling_resistance
    if not material.friction and not rolling:
        return BallFrictions(ZERO, ZERO, sticks=False, blocks=False)
    nx, ny = ((ZERO - part) / normal[2] for part in normal[:2])
    vx, vy = velocity
    approach = near.root / normal[2] if isinstance(near, WallApproach | RoundApproach) else ZERO - vx * nx - vy * ny
    slip = vx * ny - vy * nx + bodies.rim_speed(i) + bodies.scene.arrays.belt_of_wall(wall)
    normal_change = (arb(material.restitution) + 1) * approach
    y, limits = bodies.inverse_inertia_ratio[i], (arb(material.friction) * normal_change, arb(rolling) * normal_change)
    if rolling:
        frictions = share_frictions(slip, bodies.rim_speed(i), limits, y)
    else:
        frictions = limit_sticking((arb(bodies.scene.wall_tangential_restitution) + 1) * slip / (1 + y), limits[0])
    bodies.apply_spin_impulse(i, frictions.friction + frictions.rolling)
    if frictions.blocks:
        bodies.spin[i] = ZERO
    tangential = frictions.friction
    _change_velocity(bodies, i, ZERO - tangential * ny, tangential * nx, meeting.time - meeting.at)
    return frictions


def _change_velocity(bodies: BallBodies, i: int, dvx: arb, dvy: arb, wait: arb) -> None:
    """Change the velocity of a disc at an impact, `wait` seconds after the instant for which its state is stored."""
    if bodies.movable[i]:
        bodies.vx[i], bodies.vy[i] = bodies.vx[i] + dvx, bodies.vy[i] + dvy
        bodies.x[i], bodies.y[i] = bodies.x[i] - dvx * wait, bodies.y[i] - dvy * wait
