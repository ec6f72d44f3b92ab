"""Simultaneous impacts that share a disc: all possible outcomes, and the outcome that is nearest to a trace's.

If a disc collides with several bodies at one instant, the law of impact of two bodies has no unique result. The pairs
may collide one after the other until no pair approaches. Each order in which the pairs may collide leads to an
*admissible* outcome. All impulses may also act at once. With restitution e, each pair with an impulse then separates at
e times its approach speed, and the other pairs separate at least as fast (D. Baraff, Analytical methods for dynamic
simulation of non-penetrating rigid bodies, SIGGRAPH 1989).
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from itertools import product
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from carom.comparator.match_impacts import LATEST_STAMP_STEPS
from carom.comparator.scales import Scales
from carom.core import primitives
from carom.core.impact_law import ContactFriction
from carom.model.flights import free_flights
from carom.model.scene import Scene, Wall
from carom.model.trace import Trace, Vector, body_name, rim_speeds, wall_body, wall_index

#: Largest relative difference between contacts that count as simultaneous. Differences of times are divided by the
#: scene's duration, of positions by its extent, and of velocities by its greatest speed.
SAME = 1e-12

#: Largest number of intermediate states in the search for outcomes. Thousands of outcomes would not help a reader.
MOST_STATES = 4096

#: Largest number of impacts in the description of an outcome, because some sequences of impacts are infinite.
MOST_LISTED = 12

#: Largest number of contacts for which the outcome of simultaneous impulses is searched. The search tries every subset
#: of the contacts.
MOST_AT_ONCE = 8

#: Velocity and rim speed, ``(vx, vy, R w)`` with radius R and spin w, one row per disc.
Motions = NDArray[np.float64]


class TouchingBodies(NamedTuple):
    """Two bodies that touch at the instant of simultaneous impacts.

    Attributes:
        first: A disc.
        second: A disc, or a wall as a negative number.
        normal: Unit vector from first to second.
        wall_m_s: Velocity of the wall at the instant, in metres per second; 0 if the second body is a disc.
    """

    first: int
    second: int
    normal: Vector
    wall_m_s: Vector = (0.0, 0.0)


class AdmissibleOutcome(NamedTuple):
    """A possible result of several simultaneous impacts that share a disc.

    Attributes:
        how: Description of the order of impacts that leads to the outcome.
        motion_m_s: Velocity and rim speed after the impacts, ``(x, y, R w)``, one row per disc of the group, shape
            ``(k, 3)``.
    """

    how: str
    motion_m_s: Motions


class Group(NamedTuple):
    """The discs and contacts of simultaneous impacts that share a disc.

    Attributes:
        time_s: The instant.
        discs: Numbers of the discs, ascending.
        contacts: The contacts, except those of two immovable bodies.
        motion_m_s: Velocity and rim speed before the impacts, one row per disc, shape ``(k, 3)``.
    """

    time_s: float
    discs: tuple[int, ...]
    contacts: tuple[TouchingBodies, ...]
    motion_m_s: Motions


class ConventionMatch(NamedTuple):
    """The admissible outcome of simultaneous impacts that is nearest to the outcome in a trace.

    Attributes:
        group: The simultaneous impacts.
        outcomes: The admissible outcomes; empty if there are too many to list.
        nearest: Index of the outcome that is nearest to the trace's result; None if none is listed.
        distance: Largest difference from the nearest outcome. Differences of velocities are divided by the scene's
            greatest speed, and differences of rim speeds by its greatest disc or rim speed.
        matches: Whether `distance` is within rounding, or at most PIT's distance with the same step size.
    """

    group: Group
    outcomes: tuple[AdmissibleOutcome, ...]
    nearest: int | None
    distance: float
    matches: bool


def find_first_group(reference: Trace) -> Group | None:
    """Return the first simultaneous impacts of a reference that share a disc; None if there are none."""
    if not reference.ambiguous:
        return None
    scene, impacts = reference.scene, reference.impacts
    index = reference.ambiguous[0]
    time_s = float(impacts["time_s"][index])
    begin = int(np.searchsorted(impacts["time_s"], time_s - SAME * scene.duration_s))
    # Compute the positions at the instant from the flights that last until then.
    at_s, last_flights = float(impacts["time_s"][begin]), reversed(list(free_flights(reference)))
    flights = {flight.disc: flight for flight in last_flights if flight.impact >= begin and flight.end_s >= at_s}
    position = np.array([flights[disc].position_at(time_s) for disc in range(len(scene.discs))])
    extent = float(np.max(np.abs(position)) + 2.0 * np.max(scene.arrays.radius_m))
    touching = _find_touching_bodies(scene, position, time_s, SAME * extent)
    contacts = [contact for contact in touching if sum(_inverse_masses_of(scene, contact)) > 0.0]
    discs = {int(impacts["first"][index]), max(int(impacts["second"][index]), int(impacts["first"][index]))}
    while True:  # add bodies that touch the group's movable discs, until there are no more
        linked = {
            body
            for first, second, *_ in contacts
            for body in (first, second)
            if body >= 0 and any(b in discs and not scene.discs[b].immovable for b in (first, second) if b >= 0)
        }
        if linked <= discs:
            break
        discs |= linked
    group_contacts = tuple(c for c in contacts if c.first in discs and (c.second < 0 or c.second in discs))
    rim = scene.arrays.surface_speed_m_s.copy()
    bodies = np.stack([impacts["first"], impacts["second"]], axis=1)[:begin].ravel()
    # NumPy assigns in order, so each disc gets the rim speed that it has after its last impact.
    rim[bodies[bodies >= 0]] = rim_speeds(reference, "after").T[:begin].ravel()[bodies >= 0]
    ended = [(flights[disc], rim[disc]) for disc in sorted(discs)]
    motion = [
        (*flight.velocity_at(time_s), r * flight.damping.compute_kept_fraction(time_s - flight.begin_s))
        for flight, r in ended
    ]
    return Group(time_s, tuple(sorted(discs)), group_contacts, np.array(motion))


def find_admissible_outcomes(scene: Scene, group: Group, speed_m_s: float) -> tuple[AdmissibleOutcome, ...]:
    """Return the different possible results of simultaneous impacts; an empty tuple if there are too many.

    Args:
        scene: The scene.
        group: The simultaneous impacts.
        speed_m_s: The scene's greatest speed. Rounding errors are proportional to this speed.
    """
    row = {disc: k for k, disc in enumerate(group.discs)}
    tolerance = SAME * speed_m_s
    # `cell` is far above rounding errors, and far below any difference that matters. Two bodies that approach more
    # slowly than `cell` count as resting on each other.
    cell = 1e3 * tolerance
    found: list[AdmissibleOutcome] = []
    known_states: set[bytes] = set()
    stack: list[tuple[Motions, tuple[str, ...]]] = [(group.motion_m_s.copy(), ())]
    while stack:
        motion, path = stack.pop()
        key = (np.round(motion / cell) + 0.0).tobytes()  # -0.0 becomes 0.0
        if key in known_states:
            continue
        known_states.add(key)
        if len(known_states) > MOST_STATES:
            return ()
        active = [c for c in group.contacts if _compute_closing_speed(c, motion, row) > cell]
        if not active:
            impacts_text = ", then ".join(path[:MOST_LISTED]) or "no impact"
            found.append(AdmissibleOutcome(impacts_text + ", and so on" * (len(path) > MOST_LISTED), motion))
        for contact in reversed(active):  # in reverse order, because the stack returns the last item first
            other_body = contact.second if contact.second >= 0 else body_name(contact.second)
            stack.append((_apply_impact(scene, contact, motion, row), (*path, f"{contact.first} on {other_body}")))
    at_once = _solve_at_once(scene, group, row, tolerance)
    if at_once is not None and all(np.max(np.abs(at_once - o.motion_m_s)) > cell for o in found):
        found.append(AdmissibleOutcome("all at once", at_once))
    return tuple(found)


def match_outcome(reference: Trace, observed: Trace, sampling: Trace | None, scales: Scales) -> ConventionMatch | None:
    """Find the outcome nearest to a trace's for the first simultaneous impacts; None if no impacts are simultaneous."""
    group = find_first_group(reference)
    if group is None:
        return None
    outcomes = find_admissible_outcomes(reference.scene, group, scales.speed_m_s)
    if not outcomes:
        return ConventionMatch(group, (), None, math.nan, matches=False)
    nearest, distance = _find_nearest_outcome(observed, group, outcomes, scales)
    # A check once per step finds wrong normals, so a run may be as far from an outcome as PIT with the same step size.
    allowed = 0.0 if sampling is None else _find_nearest_outcome(sampling, group, outcomes, scales)[1]
    return ConventionMatch(group, outcomes, nearest, distance, matches=distance <= allowed + 1e3 * SAME)


def _find_nearest_outcome(
    trace: Trace, group: Group, outcomes: Sequence[AdmissibleOutcome], scales: Scales
) -> tuple[int, float]:
    found = _find_motions_after(trace, group)
    distances = []
    for outcome in outcomes:
        x, y, rim = (found - outcome.motion_m_s).T
        distances.append(float(np.max([np.hypot(x, y) / scales.speed_m_s, np.abs(rim) / scales.rim_m_s])))
    best = int(np.argmin(distances))
    return best, distances[best]


def _find_motions_after(trace: Trace, group: Group) -> Motions:
    """Return the motions of the group's discs after the trace's impacts at the group's instant.

    The times of the trace's impacts may differ from the instant by up to `LATEST_STAMP_STEPS` steps.
    """
    motion = group.motion_m_s.copy()
    row = {disc: k for k, disc in enumerate(group.discs)}
    slack = LATEST_STAMP_STEPS * trace.dt_s + SAME * trace.scene.duration_s
    for impact, rims in zip(trace.impacts, rim_speeds(trace, "after").T, strict=True):
        sides = {name: int(impact[name]) for name in ("first", "second") if impact[name] >= 0}
        if abs(float(impact["time_s"]) - group.time_s) <= slack and all(body in row for body in sides.values()):
            for (name, body), rim in zip(sides.items(), rims, strict=False):  # a wall is always second
                motion[row[body]] = (*impact[f"velocity_{name}_after"], rim)
    return motion


def _find_touching_bodies(
    scene: Scene, position: NDArray[np.float64], time_s: float, tolerance_m: float
) -> Iterator[TouchingBodies]:
    radius = scene.arrays.radius_m
    for i in range(len(radius)):
        offset = position[i + 1 :] - position[i]
        distance = np.hypot(*offset.T)
        for k in np.flatnonzero(distance - (radius[i] + radius[i + 1 :]) <= tolerance_m):
            normal = offset[k] / distance[k]
            yield TouchingBodies(i, i + 1 + int(k), (float(normal[0]), float(normal[1])))
        for number, wall in enumerate(scene.walls):
            leg = wall.drive.leg_at(time_s)
            relative_position = position[i] - leg.moved_at(time_s)
            if isinstance(wall, Wall):
                gap = float((relative_position - np.array(wall.point_m)) @ np.array(wall.normal)) - radius[i]
                if gap <= tolerance_m:
                    yield TouchingBodies(i, wall_body(number), (-wall.normal[0], -wall.normal[1]), leg.velocity)
                continue
            x, y = relative_position.tolist()
            for foot in wall.outline.find_feet(x, y, wall.half_width_m + float(radius[i]) + tolerance_m):
                distance = math.hypot(foot.x - x, foot.y - y)
                normal = ((foot.x - x) / distance, (foot.y - y) / distance)
                yield TouchingBodies(i, wall_body(number), normal, leg.velocity)


def _compute_closing_speed(contact: TouchingBodies, motion: Motions, row: dict[int, int]) -> float:
    first, second, normal, wall = contact
    other = motion[row[second], :2] if second >= 0 else np.array(wall)
    return float((motion[row[first], :2] - other) @ np.array(normal))


def _inverse_masses_of(scene: Scene, contact: TouchingBodies) -> tuple[float, float]:
    first, second, *_ = contact
    return 1.0 / scene.discs[first].mass_kg, 1.0 / scene.discs[second].mass_kg if second >= 0 else 0.0


def _apply_impact(scene: Scene, contact: TouchingBodies, motion: Motions, row: dict[int, int]) -> Motions:
    """Return the motions after an impact of two bodies, by the law of impact with friction."""
    first, second, normal, wall_m_s = contact
    is_wall, start, after = second < 0, scene.arrays, motion.copy()
    weights = dict(zip((first, second), _inverse_masses_of(scene, contact), strict=True))
    surface = start.materials[wall_index(second)] if is_wall else scene
    sides = [(first, -1.0)] if is_wall else [(first, -1.0), (second, 1.0)]
    normal_impulse = (1.0 + surface.restitution) * _compute_closing_speed(contact, motion, row) / sum(weights.values())
    for body, sign in sides:
        after[row[body], :2] += sign * (normal_impulse * weights[body] * np.array(normal))
    tangential_restitution = start.wall_tangential_restitution if is_wall else start.tangential_restitution
    law = ContactFriction(surface.friction, tangential_restitution)
    resists = scene.wall_rolling_resistance if is_wall else 0.0
    if not (law.friction or resists):
        return after
    tangent = np.array([-normal[1], normal[0]])
    slip = sum(motion[row[body], 2] - sign * float(motion[row[body], :2] @ tangent) for body, sign in sides)
    if is_wall:
        slip -= float(np.array(wall_m_s) @ tangent)
        slip += start.belt_of_wall(wall_index(second))
    inverse_effective_mass = sum(weights[body] * (1.0 + 1.0 / start.inertia[body]) for body, _ in sides)
    friction_impulse = primitives.tangential_impulse(*law, slip, inverse_effective_mass, normal_impulse)
    angular_impulse = friction_impulse
    if resists:  # for an impact on a wall, impulses are divided by the disc's mass
        rim, weight, inverse = motion[row[first], 2], weights[first], 1.0 / start.inertia[first]
        pushed = normal_impulse * weight
        friction, turning, _ = primitives.frictional_impulses(*law, resists, slip, rim, inverse, pushed)
        friction_impulse, angular_impulse = friction / weight, turning / weight
    for body, sign in sides:
        after[row[body], :2] += sign * friction_impulse * weights[body] * tangent
        after[row[body], 2] -= angular_impulse * weights[body] / start.inertia[body]
    return after


def _solve_at_once(scene: Scene, group: Group, row: dict[int, int], tolerance: float) -> Motions | None:
    """Return the discs' motions if all impulses act at once.

    The search tries every subset of the contacts as the contacts with an impulse. The result is None if no subset fits,
    or if there are more than `MOST_AT_ONCE` contacts. With friction, the result is also None, because it would not be
    unique (Baraff 1989).
    """
    if scene.arrays.has_friction:
        return None
    contacts = group.contacts
    if len(contacts) > MOST_AT_ONCE:
        return None
    jacobian = np.zeros((len(contacts), 2 * len(row)))
    inverse_mass = np.repeat(1.0 / scene.arrays.mass_kg[list(group.discs)], 2)
    for k, (first, second, normal, _) in enumerate(contacts):
        jacobian[k, 2 * row[first] : 2 * row[first] + 2] = np.negative(normal)
        if second >= 0:
            jacobian[k, 2 * row[second] : 2 * row[second] + 2] = normal
    matrix = (jacobian * inverse_mass) @ jacobian.T
    closing = np.array([_compute_closing_speed(c, group.motion_m_s, row) for c in contacts])
    # With restitution e, an impact multiplies the closing speed by -e. A contact that was not closing before must not
    # close afterwards.
    seconds = np.array([second for _, second, *_ in contacts], dtype=np.int64)
    restitution = scene.arrays.restitution_of(seconds)
    target_speed = -restitution * np.maximum(closing, 0.0)
    for pushing in sorted(product((True, False), repeat=len(contacts)), key=sum, reverse=True):
        active = np.flatnonzero(pushing)
        inner = matrix[np.ix_(active, active)]
        if np.linalg.matrix_rank(inner) < len(active):
            continue
        impulse = np.zeros(len(contacts))
        impulse[active] = np.linalg.solve(inner, (closing - target_speed)[active])
        if np.all(impulse >= 0.0) and np.all(closing - matrix @ impulse <= target_speed + 1e3 * tolerance):
            after = group.motion_m_s.copy()
            after[:, :2] += (inverse_mass * (jacobian.T @ impulse)).reshape(-1, 2)
            return after
    return None
