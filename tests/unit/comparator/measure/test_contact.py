"""The score of contact: what is exact, what checking once per step explains, and that planted faults are found."""

import math
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from tests.cases import each, release_after
from tests.scene_builders import disc_at, require_value, staged, wall_at

from carom import Trace, compare, solve_pic, solve_pit
from carom.catalogue import find_scenes
from carom.comparator import Grade, Score, Verdict
from carom.comparator.measure.contact import ContactScore
from carom.comparator.measure.contact_intervals import measure_contact_quality
from carom.engines.registry import load_adapter
from carom.execution.observation.engine_run import observe_run
from carom.model.step_windows import States
from carom.model.trace import SPIN_DTYPE

#: But those two in which contact ends the run by name.
CONTACT = {
    entry.name: entry.scene
    for entry in find_scenes(["contact"])
    if any(entry.scene.gravity_m_s2) and entry.name not in {"contact/pressed", "contact/corner"}
}


@cache
def run_engine(name: str, engine: str, dt_s: float = 1 / 60) -> Trace:
    """Return a run of a scene by Carom's own methods."""
    return observe_run(load_adapter(engine), CONTACT[name], "tuned", dt_s)


@cache
def run_reference(name: str) -> Trace:
    """Return PIC's trace."""
    return solve_pic(CONTACT[name])


def score_altered_states(change: Callable[[States], States], name: str) -> Score:
    """Return the score of PIC with states that are not its own."""
    trace = run_engine(name, "pic")
    return compare(run_reference(name), replace(trace, observed_states=change(require_value(trace.observed_states))))


def shake_upwards(states: States, steps: float) -> NDArray[np.float64]:
    """Return velocities along the normal of a floor, of the fall in some steps, up and down in turn."""
    speeds = [[[0.0, steps * 10.0 / 60.0 * (-1) ** k]] for k in range(len(states))]
    return np.array(speeds, dtype=np.float64)


@each("name", [*list(CONTACT)[1::3], *release_after(0, CONTACT)])
def test_pic_is_exact_in_contact(name: str) -> None:
    """PIC's states in contact equal the closed form to rounding: both grades are EXACT."""
    score = score_altered_states(lambda states: states, name)
    assert require_value(score.contact).grade is Grade.EXACT
    assert score.grade is Grade.EXACT
    assert require_value(score.contact).compared_states >= 30


@each("dt_s", release_after(1, [1 / 60, 1 / 240]))
@each("name", release_after(4, [*list(CONTACT)[1::4], *(name for k, name in enumerate(CONTACT) if k % 4 != 1)]))
def test_pit_is_no_worse_than_sampled_in_contact(name: str, dt_s: float) -> None:
    """PIT, which hops from frame to frame in contact, is SAMPLED, CLOSE or EXACT."""
    sampling = solve_pit(CONTACT[name], frame_rate_hz=round(1 / dt_s))
    score = compare(run_reference(name), run_engine(name, "pit", dt_s), sampling=sampling)
    assert require_value(score.contact).grade in {Grade.SAMPLED, Grade.CLOSE, Grade.EXACT}, score.findings
    assert score.grade in {Grade.SAMPLED, Grade.CLOSE, Grade.EXACT}, score.findings


def test_hops_of_two_frames_are_not_hidden_by_skipped_states() -> None:
    """PIT that hops at every other frame is SAMPLED, although only 150 of its 300 states are compared."""
    # PIT hops on an elastic floor where a ball rests, by g dt. Every second state is correct, so these alone would hide
    # the hops.
    (entry,) = find_scenes(["issues/brax-151"])
    trace = observe_run(load_adapter("pit"), entry.scene, "tuned", 0.01)
    score = compare(solve_pic(entry.scene), trace, sampling=trace)
    assert (require_value(score.contact).compared_states, score.grade) == (150, Grade.SAMPLED)
    assert require_value(score.contact).errors.velocity_m_s == pytest.approx(9.8 * 0.01)


def join_reasons(score: Score) -> str:
    """Return what is said of contact."""
    return "".join(finding.reason for finding in score.findings if finding.verdict is Verdict.CONTACT)


def add(**fields: Any) -> Callable[[States], States]:
    """Return a function that adds a number or vector to fields of all states."""
    return lambda states: replace(states, **{name: getattr(states, name) + value for name, value in fields.items()})


def scale(**fields: float) -> Callable[[States], States]:
    """Return a function that multiplies fields of all states."""
    return lambda states: replace(states, **{name: getattr(states, name) * factor for name, factor in fields.items()})


def stop_bounces(states: States, begin_s: float) -> States:
    """Return states of a disc that has no vertical velocity from a time until 1.342 s."""
    velocity = states.velocity_m_s.copy()
    velocity[(states.time_s > begin_s) & (states.time_s < 1.342), :, 1] = 0.0
    return replace(states, velocity_m_s=velocity)


def slip_until_1_s(states: States) -> States:
    """Return states of a disc that has no spin from 0.4 s until 1 s."""
    late = (states.time_s > 0.4) & (states.time_s < 1.0)
    return replace(states, spin_rad_s=np.where(late[:, None], 0.0, require_value(states.spin_rad_s)))


def move_half_a_step_late(states: States) -> States:
    """Return states with the position errors of an integrator: v dt / 2, since the first state."""
    return replace(states, position_m=states.position_m + 0.5 / 60.0 * (states.velocity_m_s - states.velocity_m_s[0]))


@each(
    "name, change, grade, said",
    [
        # PIT's error is 1/6 m here.
        ("slide-to-roll", add(position_m=(0.2, 0.0)), Grade.INACCURATE, ""),
        ("slide-to-roll", scale(velocity_m_s=0.0), Grade.WRONG, "a disc that should move stands still"),
        (
            "stops",
            lambda states: add(velocity_m_s=shake_upwards(states, 2.0))(states),
            Grade.INACCURATE,
            "should rest",
        ),
        ("stops", lambda states: add(velocity_m_s=shake_upwards(states, 3.0))(states), Grade.WRONG, "should rest"),
        ("incline-slips", scale(spin_rad_s=0.9), None, "angular momentum about the wall"),
        ("slide-to-roll", add(position_m=(0.0, 0.005)), None, "held 0.005 m off its wall"),
        ("slide-to-roll", add(position_m=(0.0, -0.005)), None, "held 0.005 m inside its wall"),
        ("drop", lambda states: stop_bounces(states, 0.5), None, "bounces end"),
        ("drop", lambda states: stop_bounces(states, 1.25), Grade.EXACT, ""),
        ("slide-to-roll", slip_until_1_s, None, "slips end"),
        ("stops", move_half_a_step_late, None, "moving a disc at one speed in each step explains"),
        ("holds", add(velocity_m_s=(0.008, -0.006)), None, "a disc that should rest moves at 0.01 m/s on average"),
        ("stops", scale(position_m=math.nan), Grade.WRONG, ""),
    ],
)
def test_error_in_contact_has_its_grade_and_reason(
    name: str, change: Callable[[States], States], grade: Grade | None, said: str
) -> None:
    """Each error of position, velocity or spin in contact has the listed grade, and its reason names the error."""
    score = score_altered_states(change, f"contact/{name}")
    assert grade is None or score.grade is grade
    assert said in join_reasons(score)
    assert ("bounces end" in join_reasons(score)) == (said == "bounces end")


def test_error_in_contact_is_measured() -> None:
    """The sizes of errors in contact are those that were planted."""

    def measure(name: str, change: Callable[[States], States]) -> ContactScore:
        return require_value(score_altered_states(change, f"contact/{name}").contact)

    assert require_value(measure("slide-to-roll", scale()).pit).place_m == pytest.approx(1 / 6, rel=0.01)
    # A rim that is a tenth too slow is half as much off in the angular momentum u - k R w, for k = 1/2.
    assert measure("incline-slips", scale(spin_rad_s=0.9)).momentum_m_s == pytest.approx(0.5 * 0.1 * 3.2, rel=1e-9)
    assert measure("slide-to-roll", add(position_m=(0.0, 0.005))).quality.gap_m == pytest.approx(0.005)
    stopped = measure("drop", lambda states: stop_bounces(states, 0.5))
    assert abs(stopped.late.bounces_s) > stopped.late_allowed.bounces_s
    assert measure("slide-to-roll", slip_until_1_s).late.slips_s == pytest.approx(0.5, abs=0.1)
    late = measure("stops", move_half_a_step_late)  # the disc is first seen at 2.9 m/s
    assert late.errors.place_m == pytest.approx(0.5 / 60.0 * 2.9, rel=1e-9)
    assert late.beyond_m < 1e-12
    assert late.grade is Grade.SAMPLED


@each("steps, grade", [(1.0, Grade.SAMPLED), (3.0, Grade.WRONG)])
def test_hopping_of_a_sliding_disc_is_sampled_or_wrong(steps: float, grade: Grade) -> None:
    """A disc that hops on its floor is SAMPLED at the fall of one step, as PIT is, and WRONG at that of three."""
    trace = run_engine("contact/drop", "pic")
    states = require_value(trace.observed_states)
    hops = shake_upwards(states, steps) * (states.time_s > 1.4)[:, None, None]
    changed = replace(trace, observed_states=add(velocity_m_s=hops)(states))
    score = compare(solve_pic(trace.scene), changed, sampling=solve_pit(trace.scene, frame_rate_hz=60.0))
    contact = require_value(score.contact)
    assert contact.grade is grade
    assert contact.quality.hop_m_s == pytest.approx(steps / 6.0)
    assert contact.quality.take_offs == pytest.approx(0.5, abs=0.05)
    assert "hops at" in join_reasons(score)


def test_impact_reported_where_contact_begins_is_not_spurious() -> None:
    """An impact reported at 0 s for a disc that lies on the floor from the start is not spurious."""
    trace = run_engine("contact/stops", "pic")
    touches = run_reference("contact/drop").impacts[:1].copy()
    touches["time_s"] = 0.0
    told = replace(trace, impacts=touches, spins=np.zeros(1, SPIN_DTYPE), effective_time_s=None, state_before=None)
    assert compare(run_reference("contact/stops"), told).spurious == ()


def test_impact_before_contact_is_spurious() -> None:
    """An impact reported at 0.1 s is spurious for a ball that is in the air for half a second."""
    trace = run_engine("contact/drop", "pic")
    early = np.insert(trace.impacts, 0, trace.impacts[0])
    early["time_s"][0] = 0.1
    told = replace(trace, impacts=early, effective_time_s=None, state_before=None)
    assert len(compare(run_reference("contact/drop"), told).spurious) == 1


def test_contact_in_the_last_state_alone_is_measured() -> None:
    """Contact that only the last of two states shows is measured, here with a gap of 0.25 m."""
    # A disc falls a metre at 2 m/s^2 and stays there; the states are at 0.5 and 1.25 s.
    bodies = disc_at(0.0, 1.5), wall_at(0.0, 0.0, 0.0, 1.0)
    truth = solve_pic(staged("drop", *bodies, wall_restitution=0.0, gravity_m_s2=(0.0, -2.0), duration_s=1.25))
    places, speeds = np.array([[[0.0, 1.25]], [[0.0, 0.5]]]), np.array([[[0.0, -1.0]], [[0.0, 0.0]]])
    seen = States(np.array([0.5, 1.25]), places, speeds)
    found = measure_contact_quality(truth, seen, replace(seen, position_m=places + 0.25), 1 / 8)
    assert (found.gap_m, found.hop_m_s) == (0.25, 0.0)
