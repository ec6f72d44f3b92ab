"""Local errors: each impact of a run is compared with the exact impact that follows from the run's own state before it.

In a long run, chaos makes the reference's trajectory useless for a comparison. But the instant, the normal and the
velocities after an impact can be computed exactly from the run's own state before this impact. So each impact of a run
can be scored separately, however long the run is.

PIT's result from the same state can also be computed. PIT applies the impact at the first step boundary at or after
contact, along the line of centres at that time. So the local error can be split into an error of checking once per step
and an error of the solver.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, fields
from functools import cached_property
from itertools import groupby
from typing import Any

import numpy as np
from numpy.typing import NDArray

from carom.comparator.measure.errors import build_impact_bodies, compute_restitutions, larger_error
from carom.comparator.non_finite import find_finite_impacts
from carom.comparator.scales import Array, Scales, compute_median
from carom.comparator.slowing import Slowing
from carom.comparator.stepwise import body_states
from carom.comparator.stepwise.scene_bodies import FiniteWall, SceneBodies
from carom.core.impact_law import ContactFrictions, RoughBodies, resolve_rough_impact
from carom.core.time_of_impact import time_of_impact
from carom.core.wall_features import Mover
from carom.model.disc_arrays import HalfPlane
from carom.model.flights import free_flights
from carom.model.trace import STATE_DTYPE, Trace, rim_speeds, turn_times, velocities, wall_index

Vector = tuple[float, float]


@dataclass(frozen=True, eq=False)
class LocalErrors:
    """Local errors of all observed impacts, one entry per impact; NaN if the state before the impact is not known.

    Attributes:
        time_s: Lateness of each impact in seconds: its effective time (or its reported time, if the effective time is
            unknown) minus its exact time. At the effective time, the paths before and after the impact meet.
        velocity: Magnitude of the velocity error after the impact, for the body with the larger error, divided by the
            scene's greatest speed.
        restitution: Ratio of the speeds of separation and approach along the exact normal, minus the scene's
            coefficient of restitution.
        spin: Error of the rim speed after the impact, for the body with the larger error. The error is divided by the
            scene's greatest speed of discs and rims. NaN if no disc spins.
        energy: Kinetic energy of the two bodies after the impact minus the exact kinetic energy, divided by the scene's
            energy (see `Scales`).
        sampling_velocity: Velocity error of PIT, started from the same state with the same step size; NaN if PIT finds
            no impact, or the run has no steps.
        solver_velocity: Velocity difference between the run and PIT started from the same state, divided by the scene's
            greatest speed.
        sampling_spin: Spin error of PIT started from the same state.
        solver_spin: Spin difference between the run and PIT started from the same state.
        spurious: Indices of the run's impacts that do not happen if PIC starts from the run's own state.
    """

    time_s: Array
    velocity: Array
    spin: Array
    restitution: Array
    energy: Array
    sampling_velocity: Array
    solver_velocity: Array
    sampling_spin: Array
    solver_spin: Array
    spurious: tuple[int, ...]

    @cached_property
    def scored(self) -> int:
        """Number of impacts that could be scored."""
        return int(np.isfinite(self.velocity).sum())

    def median(self, name: str) -> float:
        """Return the median magnitude of the error with this field name; NaN if no impact has a known error."""
        known = self._list_known(name)
        return compute_median(known) if len(known) else math.nan

    def worst(self, name: str) -> float:
        """Return the largest magnitude of the error with this field name; NaN if no impact has a known error."""
        known = self._list_known(name)
        return float(np.max(known)) if len(known) else math.nan

    def _list_known(self, name: str) -> Array:
        values: Array = np.abs(getattr(self, name))
        return values[~np.isnan(values)]


#: Names of the fields of `LocalErrors` with one number per impact.
_ERRORS = tuple(field.name for field in fields(LocalErrors) if field.name != "spurious")


def find_own_states(trace: Trace) -> NDArray[np.void]:
    """Return the run's state before each impact, either recorded or computed by free flight after earlier impacts."""
    if trace.state_before is not None:
        return trace.state_before
    states = np.zeros(len(trace.impacts), STATE_DTYPE)
    for k, ended in groupby(free_flights(trace), key=lambda flight: flight.impact):
        flights = list({flight.disc: flight for flight in ended}.values())
        if k < len(states):
            begin_s = states["time_s"][k] = float(np.max([flight.begin_s for flight in flights]))
            for side, flight in zip(("first", "second"), flights, strict=False):  # a wall has no flight
                states[f"position_{side}"][k] = flight.position_at(begin_s)
    return states


class _Bodies:
    """The two bodies of each impact, in the run's own state before the impact. A wall has no position."""

    def __init__(self, trace: Trace, state: NDArray[np.void], belt_speeds: Array) -> None:
        start, second = trace.scene.arrays, trace.impacts["second"]
        self.wall = second < 0
        self.position = np.stack([state["position_first"], state["position_second"]])
        self.velocity = velocities(trace.impacts, "before")
        self.radius = start.radius_m[np.stack([trace.impacts["first"], np.maximum(second, 0)])]
        self.restitution = start.restitution_of(second)
        self.bodies, self.contacts = build_impact_bodies(trace, rim_speeds(trace, "before") + belt_speeds)

    def compute_after(self, normals: Array) -> tuple[Array, Array]:
        """Return velocities and rim speeds after each impact for k different normals; NaN if the normal is NaN.

        The normals have shape ``(k, m, 2)``, and can have any length. The velocities have shape ``(k, 2, m, 2)``, and
        the rim speeds have shape ``(k, 2, m)``.
        """
        cases, rows = np.nonzero(~np.isnan(normals).any(axis=-1))
        one, two = (RoughBodies(*(numbers[rows] for numbers in body)) for body in self.bodies)
        contacts = ContactFrictions(*(numbers[rows] for numbers in self.contacts))
        after = resolve_rough_impact(one, two, normals[cases, rows], self.restitution[rows], contacts)
        velocity = np.full((2, *normals.shape), math.nan)
        rim = np.full(velocity.shape[:-1], math.nan)
        for side, body in enumerate(after):
            velocity[side, cases, rows], rim[side, cases, rows] = body.velocity, body.rim
        return velocity.swapaxes(0, 1), rim.swapaxes(0, 1)

    def compute_energies(self, velocity: Array, rim: Array) -> Array:
        """Return the kinetic energy of each impact's two bodies for k sets of speeds, in joules, shape ``(k, m)``."""
        numbers = np.array([(body.mass, body.inertia) for body in self.bodies])
        mass, inertia = np.where(np.isinf(numbers), 0.0, numbers).swapaxes(0, 1)
        energies: Array = (0.5 * mass * ((velocity**2).sum(axis=-1) + inertia * rim**2)).sum(axis=1)
        return energies


def measure_local_errors(trace: Trace, scales: Scales) -> LocalErrors:
    """Compare each impact of a trace with a PIC run that starts from the trace's own state before the impact.

    Only straight paths are measured. In scenes with gravity, damping or a table, all errors are NaN.
    """
    if any(trace.scene.gravity_m_s2) or Slowing.of(trace.scene):
        unknown: dict[str, Any] = dict.fromkeys(_ERRORS, np.full(len(trace.impacts), math.nan))
        return LocalErrors(**unknown, spurious=())
    impacts, state, scene = trace.impacts, find_own_states(trace), trace.scene.arrays
    # Conveyor speeds of both bodies; 0 for the first body, which is always a disc.
    belt_speeds = np.stack([np.zeros(len(impacts)), scene.belt_speeds_of(impacts["second"])])
    start, bodies = state["time_s"], _Bodies(trace, state, belt_speeds)
    # An impact with NaN or an infinity has no local error, because a verdict reports such impacts.
    known = np.isfinite(bodies.position).all(axis=(0, 2)) & np.isfinite(start) & find_finite_impacts(trace)
    turning = [i for i, drive in zip(scene.driven_discs, scene.disc_drives, strict=True) if len(drive.legs) > 1]
    for disc in turning:  # a disc whose prescribed velocity changes has no straight path
        known &= (impacts["first"] != disc) & (impacts["second"] != disc)
    wait, normal = np.full(len(impacts), math.nan), np.zeros((len(impacts), 2))
    pairs, walls = np.flatnonzero(known & ~bodies.wall), np.flatnonzero(known & bodies.wall)
    wait[pairs] = _compute_time_to_contact(bodies, pairs)
    wait[walls], normal[walls] = _find_wall_meetings(trace, bodies, start, walls)
    if (wait < 0.0).any():
        # If two bodies overlap, they met in the past, but after the last earlier impact of each body.
        since_turn = np.minimum(_find_last_turn_times(trace) - start, 0.0)
        wait = np.where(wait < 0.0, np.maximum(wait, since_turn), wait)
    happens = known & np.isfinite(wait)
    disc_rows = np.flatnonzero(happens & ~bodies.wall)
    first, second = bodies.position[:, disc_rows] + bodies.velocity[:, disc_rows] * wait[disc_rows, None]
    normal[disc_rows] = second - first
    normal[disc_rows] /= np.hypot(*normal[disc_rows].T)[:, None]
    normal[~happens] = math.nan
    after, rim = velocities(impacts, "after"), rim_speeds(trace, "after") + belt_speeds
    normals = np.stack([normal, _find_pit_normals(trace, bodies, start, wait, normal)])
    (expected, sampled), (expected_rim, sampled_rim) = bodies.compute_after(normals)
    energy, expected_energy = bodies.compute_energies(np.stack([after, expected]), np.stack([rim, expected_rim]))
    instant = np.where(happens, start + wait, math.nan)
    differences = (after - expected, sampled - expected, after - sampled)
    velocity, sampling_velocity, solver_velocity = (larger_error(one) / scales.speed_m_s for one in differences)
    rims = np.abs([rim - expected_rim, sampled_rim - expected_rim, rim - sampled_rim]).max(axis=1)  # NaN if unknown
    spin, sampling_spin, solver_spin = rims / scales.rim_m_s if scene.turns else np.full_like(rims, math.nan)
    return LocalErrors(
        time_s=turn_times(trace) - instant,
        velocity=velocity,
        spin=spin,
        restitution=compute_restitutions(bodies.velocity, after, normal) - bodies.restitution,
        energy=(energy - expected_energy) / (scales.energy_j or 1.0),
        sampling_velocity=sampling_velocity,
        solver_velocity=solver_velocity,
        sampling_spin=sampling_spin,
        solver_spin=solver_spin,
        spurious=tuple(np.flatnonzero(known & ~np.isfinite(wait)).tolist()),
    )


def _find_last_turn_times(trace: Trace) -> Array:
    """Return, for each impact, the time of its bodies' latest earlier impact, in seconds; 0 if there is none."""
    latest = np.zeros(len(trace.scene.discs))
    result = np.zeros(len(trace.impacts))
    pairs = zip(trace.impacts["first"], trace.impacts["second"], strict=True)
    for k, (time, pair) in enumerate(zip(turn_times(trace), pairs, strict=True)):
        bodies = [body for body in pair if body >= 0]
        result[k] = np.max(latest[bodies])
        latest[bodies] = time
    return result


def _compute_time_to_contact(bodies: _Bodies, rows: NDArray[np.intp]) -> Array:
    """Return the seconds until discs meet on free paths: negative if they overlap, infinite if they never meet."""
    (p1, p2), (v1, v2), (r1, r2) = bodies.position[:, rows], bodies.velocity[:, rows], bodies.radius[:, rows]
    wait_s = np.asarray(time_of_impact(p1, v1, r1, p2, v2, r2), dtype=np.float64)
    d, u, reach = p2 - p1, v2 - v1, r1 + r2
    a, b, c = (u * u).sum(axis=1), (d * u).sum(axis=1), (d * d).sum(axis=1) - reach**2
    ago = c / (np.sqrt(np.maximum(b * b - a * c, 0.0)) - b)
    return np.where((wait_s == 0.0) & (c < 0.0), ago, wait_s)


def _find_wall_meetings(trace: Trace, bodies: _Bodies, begun_s: Array, rows: NDArray[np.intp]) -> tuple[Array, Array]:
    """Return the seconds until discs meet walls on free paths, and the normals at the meetings."""
    wait, normal = np.full(len(rows), math.inf), np.zeros((len(rows), 2))
    if not len(rows):
        return wait, normal
    scene_bodies = SceneBodies(trace.scene)
    for row, k in enumerate(rows.tolist()):
        number, radius = wall_index(int(trace.impacts["second"][k])), float(bodies.radius[0, k])
        begin_s = float(begun_s[k])
        for leg in scene_bodies.wall_drives[number].legs_from(begin_s):
            from_s = max(leg.begin_s, begin_s)
            velocity = bodies.velocity[0, k] - leg.velocity
            place = bodies.position[0, k] + bodies.velocity[0, k] * (from_s - begin_s) - leg.moved_at(from_s)
            wait_s, towards = _find_wall_meeting(scene_bodies.walls[number], place, velocity, radius)
            if from_s + wait_s < leg.end_s:
                wait[row], normal[row] = from_s + wait_s - begin_s, towards
                break
    return wait, normal


def _find_wall_meeting(
    wall: HalfPlane | FiniteWall, place: Array, velocity: Array, radius: float
) -> tuple[float, Vector]:
    """Return the seconds until a disc meets a wall at rest, and the normal to the wall."""
    if isinstance(wall, tuple):
        into = np.array(wall[2:])
        speed, gap = float(velocity @ into), float((place - wall[:2]) @ into) - radius
        return -gap / speed if speed < 0.0 else math.inf, (-wall[2], -wall[3])
    (x, y), (vx, vy) = place.tolist(), velocity.tolist()
    mover = Mover.at((x, y), (vx, vy), radius)
    features = wall.features
    wait_s, feature, _ = features.first_touch(mover, body_states.NO_FEATURE)
    if feature == body_states.NO_FEATURE:
        return math.inf, (0.0, 0.0)
    if wait_s == 0.0:
        wait_s = features.overlap_start(feature, mover)
    mover_at_contact = mover._replace(x=(x + vx * wait_s, 0.0), y=(y + vy * wait_s, 0.0))
    nx, ny = features.normal(feature, mover_at_contact)
    return wait_s, (-nx, -ny)


def _find_pit_normals(trace: Trace, bodies: _Bodies, begun_s: Array, wait: Array, normal: Array) -> Array:
    """Return the directions along which PIT applies its impacts, if PIT starts from the state before each impact.

    The shape is ``(m, 2)``. The directions are NaN where PIT finds no impact.
    """
    dt_s = trace.dt_s
    if not dt_s:
        return np.full_like(normal, math.nan)
    # On a half-plane wall, a late impact has the same normal and lever arm as an exact one.
    found = np.where(bodies.wall[:, None], normal, math.nan)
    d, u = (states[1] - states[0] for states in (bodies.position, bodies.velocity))
    # Rounding must not delay a contact at a step boundary to the next boundary.
    steps = np.maximum(np.ceil(wait / dt_s * (1.0 - 2.0**-40)), 0.0)
    arrays = trace.scene.arrays
    for k in () if arrays.has_half_planes else np.flatnonzero(bodies.wall & np.isfinite(steps)).tolist():
        number = wall_index(int(trace.impacts["second"][k]))
        wall, time_s = arrays.walls[number], float(begun_s[k] + steps[k] * dt_s)
        if isinstance(wall, tuple):
            continue
        leg = arrays.drive_of_wall(number).leg_at(time_s)
        velocity = bodies.velocity[0, k] - leg.velocity
        x, y = (bodies.position[0, k] + bodies.velocity[0, k] * steps[k] * dt_s - leg.moved_at(time_s)).tolist()
        foot = wall.find_nearest(x, y)
        towards, reach = np.array([foot.x - x, foot.y - y]), wall.half_width + float(bodies.radius[0, k])
        is_met = float(velocity @ towards) > 0.0 and 0.0 < math.hypot(*towards) <= reach * (1.0 + 2.0**-40)
        found[k] = towards / math.hypot(*towards) if is_met else math.nan
    disc_rows = np.flatnonzero(np.isfinite(steps) & ~bodies.wall)
    line = d[disc_rows] + u[disc_rows] * (steps[disc_rows] * dt_s)[:, None]
    reach = bodies.radius[:, disc_rows].sum(axis=0)
    is_met = ((line * u[disc_rows]).sum(axis=1) < 0.0) & (np.hypot(*line.T) <= reach * (1.0 + 2.0**-40))
    found[disc_rows[is_met]] = line[is_met]
    return found
