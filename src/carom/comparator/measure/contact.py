"""Errors of discs that slide, roll or rest, relative to the exact solution of Coulomb's law.

The run's states are compared with the reference's states at the same instants. PIT has no lasting contact: its discs
bounce at each check for overlap. Errors up to PIT's are allowed. Three other kinds of error in lasting contact are also
allowed. First, an integrator may move a disc at a constant speed for a whole step, which causes a position error of
``dt / 2`` times the change of the disc's speed in the step. Second, velocities may be wrong by ``g dt (1 + f)``, the
change that gravity g and the coefficient of friction f (at most 1) cause in a step. Third, an impact may be a step
late.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from carom.comparator.align_impacts import AlignedRun
from carom.comparator.grades import Grade, find_worst_grade
from carom.comparator.measure.contact_intervals import (
    LAST,
    ContactQuality,
    Ends,
    find_contact_intervals,
    measure_contact_quality,
    measure_late_ends,
)
from carom.comparator.scales import Array, compute_lengths
from carom.comparator.stepwise.resting_pairs import RESTING_STEPS
from carom.comparator.thresholds import THRESHOLDS
from carom.model.flights import free_flights
from carom.model.scene import Scene
from carom.model.step_windows import States
from carom.model.trace import Outcome, Trace, wall_index
from carom.solvers.pit.clock import FrameClock
from carom.solvers.pit.solve import start_pit_run


class ContactErrors(NamedTuple):
    """The largest differences from the reference in lasting contact: positions (m), velocities and rim speeds (m/s)."""

    place_m: float
    velocity_m_s: float
    rim_m_s: float


@dataclass(frozen=True)
class ContactScore:
    """Errors and grade of a run while its discs are in lasting contact.

    Attributes:
        begin_s: Time at which lasting contact begins in the reference, in seconds.
        compared_states: Number of states that were compared.
        errors: Errors of the run.
        pit: Errors of PIT with the same step size; None for a run without steps.
        allowed: Largest errors that checking once per step and an integrator's step can cause.
        beyond_m: The position error that remains after subtracting ``dt / 2`` times the change of velocity since the
            first state. The subtracted part is the error of an integrator that moves a disc at one speed for a whole
            step.
        momentum_m_s: Largest error of a disc's angular momentum about a point on the wall's surface, divided by mass
            and radius. Friction does not change the angular momentum about such a point. NaN if a disc meets other
            discs or several walls.
        rest_m_s: Largest mean final speed of a disc that should rest; NaN if no disc should rest.
        frozen: Whether a disc stands still at the end although it should move.
        quality: Gaps and hops of discs that should stay on their walls.
        late: How late the bounces and the sliding of discs end.
        late_allowed: Largest allowed errors of the times in `late`. A method can't show hops that are shorter than its
            step dt, so with restitution e its bounces may end early by ``dt / (1 - e)``. The allowed errors are larger
            if the compared states are several steps apart.
        grade: The grade of the contact.
    """

    begin_s: float
    compared_states: int
    errors: ContactErrors
    pit: ContactErrors | None
    allowed: ContactErrors
    beyond_m: float
    momentum_m_s: float
    rest_m_s: float
    frozen: bool
    quality: ContactQuality
    late: Ends
    late_allowed: Ends
    grade: Grade


def score_contact(run: AlignedRun) -> ContactScore | None:
    """Score the part of a run with lasting contact; None if there is no such part, or if states were not stored."""
    reference, observed, scales = run.reference, run.observed, run.scales
    begin_s = reference.contact_s
    if observed.observed_states is None or reference.modes is None or reference.outcome is not Outcome.COMPLETED:
        return None
    ties = [float(reference.impacts["time_s"][row]) for row in reference.ambiguous]
    end_s = min([reference.end_time_s, *(np.nextafter(tie, -math.inf) for tie in ties)])
    observed_states = observed.observed_states.select_rows(observed.observed_states.time_s <= end_s)
    inside = observed_states.time_s >= begin_s
    struck_s, dt_s = reference.impacts["time_s"][reference.impacts["time_s"] > begin_s], observed.dt_s
    # Skip states close to an impact, because rounding decides whether such states are before or after the impact.
    for time_s in struck_s.tolist():
        inside &= np.abs(observed_states.time_s - time_s - 0.5 * dt_s) > dt_s
    if not inside.any():
        return None
    whole_truth = compute_states_at(reference, observed_states.time_s)
    truth, slow = whole_truth.select_rows(inside), RESTING_STEPS * math.hypot(*reference.scene.gravity_m_s2) * dt_s

    def measure_states(states: States) -> tuple[ContactErrors, float, bool, ContactQuality, Ends]:
        in_contact = states.select_rows(inside)
        quality = measure_contact_quality(reference, truth, in_contact, dt_s)
        late = measure_late_ends(reference, whole_truth, states, dt_s, end_s)
        errors = _measure_errors(reference, truth, in_contact)
        return errors, *_measure_final_motion(truth, in_contact, slow), quality, late

    own_errors, rest_m_s, frozen, quality, late = measure_states(observed_states)
    seen = observed_states.select_rows(inside)
    pit, allowed, late_allowed, fast = None, ContactErrors(0.0, 0.0, 0.0), Ends(0.0, 0.0), 0.0
    place = run.place_rounding * scales.reach_m
    if dt_s:
        hopping = _compute_pit_states(reference.scene, dt_s, tuple(whole_truth.time_s.tolist()))
        pit, pit_rest_m_s, _, pit_quality, pit_late = measure_states(hopping)
        allowed = _compute_allowed_errors(reference.scene, truth, dt_s, pit, len(struck_s))
        late_allowed = _compute_allowed_lateness(reference, pit_late, observed.observed_states.time_s, dt_s)
        # In PIT, a disc never rests but hops, and hops higher on a wall with larger restitution.
        fast = float(np.fmax.reduce([slow, pit_rest_m_s, pit_quality.hop_m_s]))
        # Rounding may explain position errors of at most a hundredth of the displacement in a step. The position of a
        # disc that never moves is not rounded at each step.
        step_m = dt_s * _find_greatest_length(truth.velocity_m_s)
        place = min(place, THRESHOLDS.close * step_m if step_m else run.rounding * scales.reach_m)
    moves = rest_m_s > fast or quality.hop_m_s > fast
    wrong = moves or frozen or not all(math.isfinite(error) for error in own_errors)
    exact = ContactErrors(place, run.rounding * scales.speed_m_s, run.rounding * scales.rim_m_s)
    grade = Grade.WRONG if wrong else _grade_contact(own_errors, exact, allowed)
    if dt_s and any(abs(late_s) > most_s for late_s, most_s in zip(late, late_allowed, strict=True)):
        grade = find_worst_grade(grade, Grade.INACCURATE)
    return ContactScore(
        begin_s=begin_s,
        compared_states=len(truth.time_s),
        errors=own_errors,
        pit=pit,
        allowed=allowed,
        beyond_m=_measure_error_beyond_half_step(truth, seen, dt_s),
        momentum_m_s=_measure_momentum_error(reference, seen),
        rest_m_s=rest_m_s,
        frozen=frozen,
        quality=quality,
        late=late,
        late_allowed=late_allowed,
        grade=grade,
    )


def _compute_allowed_lateness(reference: Trace, pit: Ends, observed_s: Array, dt_s: float) -> Ends:
    """Return the largest allowed errors of the times at which discs stop bouncing and stop sliding.

    The allowed errors include PIT's own errors.

    The smallest hop that counts takes `RESTING_STEPS` steps to rise, and as many steps to fall. The allowed errors are
    larger if the compared states are several steps apart.
    """
    materials = reference.scene.arrays.materials
    restitutions = (materials[wall_index(touch.wall)].restitution for touch in find_contact_intervals(reference))
    # With restitution 1, hops never end.
    lost_s = max((dt_s / (1.0 - e) for e in restitutions if e < 1.0), default=0.0)
    apart_s = 2.0 * float(np.max(np.diff(observed_s, prepend=0.0))) + 2.0 * RESTING_STEPS * dt_s
    return Ends(*(apart_s + float(np.fmax(lost_s, abs(late_s))) for late_s in pit))


def _measure_error_beyond_half_step(truth: States, observed: States, dt_s: float) -> float:
    """Return the position error that remains if an integrator may move discs at one speed for a whole step.

    The integrator may use the speed at the start or at the end of the step. The smaller of the two remaining errors is
    returned.
    """
    half = 0.5 * dt_s * (truth.velocity_m_s - truth.velocity_m_s[0])
    error_m = observed.position_m - truth.position_m
    return min(_find_greatest_length(error_m - sign * half) for sign in (1.0, -1.0))


def _compute_allowed_errors(
    scene: Scene, truth: States, dt_s: float, pit: ContactErrors, impacts: int
) -> ContactErrors:
    arrays = scene.arrays
    speed = _find_greatest_length(truth.velocity_m_s)
    fall = math.hypot(*scene.gravity_m_s2) * dt_s
    # With a coefficient of friction above 1, sliding ends within the step. Friction is then only as large as needed to
    # prevent sliding.
    rubs = fall * min(1.0, max(material.friction for material in arrays.materials))
    rims = (rubs + fall * min(1.0, scene.wall_rolling_resistance)) / float(np.min(arrays.inertia))
    place = (speed + fall) * dt_s * (1 + impacts)
    return ContactErrors(max(pit.place_m, place), pit.velocity_m_s + fall + rubs, pit.rim_m_s + max(rubs, rims))


def compute_states_at(trace: Trace, times_s: Array) -> States:
    """Compute the states of a trace at ascending times, from its impacts and its lasting contacts."""
    place, velocity = np.zeros((2, len(times_s), len(trace.scene.discs), 2))
    for flight in free_flights(trace):
        since = (times_s >= flight.begin_s) & (times_s <= flight.end_s)  # at an impact, use the flight after it
        for row in np.flatnonzero(since).tolist():
            passed = float(times_s[row]) - flight.begin_s
            place[row, flight.disc] = flight.position_at(float(times_s[row]))
            velocity[row, flight.disc] = flight.velocity_m_s + flight.pull_m_s2 * passed
    return States(times_s, place, velocity, _compute_spins_at(trace, times_s))


def _compute_spins_at(trace: Trace, times_s: Array) -> Array:
    """Return the spins of the discs of a trace at ascending times, in radians per second, shape ``(k, n)``."""
    found, rates = np.tile(trace.scene.arrays.spins, (len(times_s), 1)), np.zeros(len(trace.scene.discs))
    modes = [] if trace.modes is None else list(trace.modes[::-1])

    def change(time_s: float, disc: int, spin: float) -> None:
        later = times_s >= time_s
        found[later, disc] = spin + rates[disc] * (times_s[later] - time_s)

    for k in range(len(trace.impacts) + 1):
        while modes and modes[-1]["impacts"] <= k:
            mode = modes.pop()
            rates[mode["disc"]] = mode["spin_rate"]
            change(mode["time_s"], mode["disc"], mode["spin"])
        if trace.spins is not None and k < len(trace.impacts):
            for side in ("first", "second"):
                if (disc := trace.impacts[side][k]) >= 0:
                    change(trace.impacts["time_s"][k], disc, trace.spins[f"{side}_after"][k])
    return found


def _find_greatest_length(vectors: Array) -> float:
    return float(np.max(compute_lengths(vectors)))


def _measure_errors(reference: Trace, truth: States, observed: States) -> ContactErrors:
    place, velocity = observed.position_m - truth.position_m, observed.velocity_m_s - truth.velocity_m_s
    rims = reference.scene.arrays.radius_m * (observed.spins - truth.spins)
    rim = float(np.max(np.abs(rims))) if reference.scene.arrays.turns else 0.0
    return ContactErrors(_find_greatest_length(place), _find_greatest_length(velocity), rim)


@lru_cache(maxsize=32)
def _compute_pit_states(scene: Scene, dt_s: float, times_s: tuple[float, ...]) -> States:
    """Return PIT's states just after its checks for overlap at the given times, which must be in ascending order."""
    run = start_pit_run(scene, FrameClock(step_s=dt_s))
    fall = np.where(scene.arrays.movable[:, None], np.array(scene.gravity_m_s2), 0.0)
    places, velocities, spins = [], [], []
    for time_s in times_s:
        run.advance_frames(round(time_s / dt_s) + 1 - run.frames)
        back_s = run.time_s - time_s  # the run has already advanced to the next frame
        velocities.append(run.velocities() - fall * back_s)
        places.append(run.positions() - velocities[-1] * back_s - 0.5 * fall * back_s * back_s)
        spins.append(np.zeros(len(scene.discs)) if (run_spins := run.spins()) is None else run_spins)
    return States(np.array(times_s), np.array(places), np.array(velocities), np.array(spins))


def _measure_final_motion(truth: States, observed: States, slow: float) -> tuple[float, bool]:
    """Return the largest mean final speed of a disc that should rest, and whether a disc wrongly stands still."""
    true_speed, speed = (compute_lengths(states.velocity_m_s[-LAST:]) for states in (truth, observed))
    rests = (true_speed == 0.0).all(axis=0)
    moves = (true_speed > 2.0 * slow).all(axis=0)
    mean = speed.mean(axis=0)
    rest = float(mean[rests].max()) if rests.any() and len(speed) == LAST else math.nan
    frozen = bool(np.any(mean[moves] <= THRESHOLDS.close * true_speed[:, moves].mean(axis=0)))
    return rest, frozen


def _measure_momentum_error(reference: Trace, observed: States) -> float:
    """Return the largest change of angular momentum about the wall, without the change that gravity causes."""
    scene, modes = reference.scene, reference.modes
    walls = scene.arrays.walls
    if len(scene.discs) > 1 or len(walls) > 1 or modes is None or not isinstance(walls[0], tuple):
        return math.nan
    resists = scene.wall_rolling_resistance > 0.0  # rolling resistance changes angular momentum
    if resists or observed.spin_rad_s is None or math.isinf(k := float(scene.arrays.inertia[0])):
        return math.nan
    nx, ny = walls[0][2:]
    along, (gx, gy) = np.array([ny, -nx]), scene.gravity_m_s2
    ratio = k * float(scene.arrays.radius_m[0])
    momentum_at_begin = float(modes[0]["velocity"] @ along) - ratio * float(modes[0]["spin"])
    expected = momentum_at_begin + (gx * ny - gy * nx) * (observed.time_s - float(modes[0]["time_s"]))
    return float(np.max(np.abs(observed.velocity_m_s[:, 0] @ along - ratio * observed.spin_rad_s[:, 0] - expected)))


def _grade_contact(own_errors: ContactErrors, exact: ContactErrors, allowed: ContactErrors) -> Grade:
    def is_within(part: float) -> bool:
        return all(o <= part * a + e for o, a, e in zip(own_errors, allowed, exact, strict=True))

    parts = {Grade.EXACT: 0.0, Grade.CLOSE: THRESHOLDS.close, Grade.SAMPLED: 1.0}
    return next((grade for grade, part in parts.items() if is_within(part)), Grade.INACCURATE)
