"""The score of contact: what is exact, what checking once per step explains, and that planted faults are found."""

import math
from collections.abc import Callable
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from numpy.typing import NDArray
from tests.cases import each, release_after
from tests.scene_builders import disc_at, require_value, staged, wall_at

from carom import Trace, compare, solve_pic, solve_pit
from carom.catalogue import find_scenes
from carom.comparator import Grade, Score, Verdict
from carom.comparator.measure.contact import compute_states_at
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


@each("name", [*list(CONTACT)[::2], *release_after(0, CONTACT)])
def test_states_computed_from_a_trace_equal_those_of_the_run(name: str) -> None:
    """Positions, velocities and spins computed from a trace at any time equal those of a run that ends then."""
    trace = run_reference(name)
    times = np.sort(np.random.default_rng(3).uniform(0.0, trace.end_time_s, 12))
    motion = compute_states_at(trace, times)
    for row, time_s in enumerate(times.tolist()):
        there = solve_pic(CONTACT[name], until_s=time_s)
        assert motion.position_m[row] == pytest.approx(there.final_position_m, abs=1e-13)
        assert motion.velocity_m_s[row] == pytest.approx(there.final_velocity_m_s, abs=1e-12)
        if there.final_spin_rad_s is not None and motion.spin_rad_s is not None:
            assert motion.spin_rad_s[row] == pytest.approx(there.final_spin_rad_s, abs=1e-12)


def test_position_error_above_that_of_pit_is_inaccurate() -> None:
    """A position error of 0.2 m in contact, above PIT's 1/6 m, is INACCURATE with the verdict CONTACT."""
    aside = np.array([0.2, 0.0])
    score = score_altered_states(
        lambda states: replace(states, position_m=states.position_m + aside), "contact/slide-to-roll"
    )
    assert require_value(require_value(score.contact).pit).place_m == pytest.approx(1 / 6, rel=0.01)
    assert score.grade is Grade.INACCURATE
    assert Verdict.CONTACT in score.verdicts


def test_disc_that_is_frozen_in_contact_is_wrong() -> None:
    """A run in which a sliding disc has no velocity is WRONG, and the reason says that it stands still."""
    score = score_altered_states(
        lambda states: replace(states, velocity_m_s=np.zeros_like(states.velocity_m_s)), "contact/slide-to-roll"
    )
    assert require_value(score.contact).frozen
    assert score.grade is Grade.WRONG
    assert any("a disc that should move stands still" in finding.reason for finding in score.findings)


@each("steps, grade", [(2.0, Grade.INACCURATE), (3.0, Grade.WRONG)])
def test_jitter_of_a_resting_disc_is_inaccurate_or_wrong(steps: float, grade: Grade) -> None:
    """Jitter of a disc that should rest is INACCURATE at two steps' fall, and WRONG at three."""
    score = score_altered_states(
        lambda states: replace(states, velocity_m_s=states.velocity_m_s + shake_upwards(states, steps)), "contact/stops"
    )
    assert score.grade is grade
    assert any("that should rest" in finding.reason for finding in score.findings)


def test_reduced_spin_is_an_error_of_the_angular_momentum() -> None:
    """A rim that is a tenth too slow is half as much off in the angular momentum u - k R w, for k = 1/2."""
    score = score_altered_states(
        lambda states: replace(states, spin_rad_s=0.9 * require_value(states.spin_rad_s)), "contact/incline-slips"
    )
    assert require_value(score.contact).momentum_m_s == pytest.approx(0.5 * 0.1 * 3.2, rel=1e-9)
    assert any("angular momentum about the wall" in finding.reason for finding in score.findings)


def join_reasons(score: Score) -> str:
    """Return what is said of contact."""
    return "".join(finding.reason for finding in score.findings if finding.verdict is Verdict.CONTACT)


def move_states(states: States, where: NDArray[np.bool_], place: float = 0.0, speed: float | None = None) -> States:
    """Return states on a floor, some of them higher up by a length, or at another speed off the floor."""
    position, velocity = states.position_m.copy(), states.velocity_m_s.copy()
    position[where, :, 1] += place
    if speed is not None:
        velocity[where, :, 1] = speed
    return replace(states, position_m=position, velocity_m_s=velocity)


@each("steps, grade", [(1.0, Grade.SAMPLED), (3.0, Grade.WRONG)])
def test_hopping_of_a_sliding_disc_is_sampled_or_wrong(steps: float, grade: Grade) -> None:
    """A disc that hops on its floor is SAMPLED at the fall of one step, as PIT is, and WRONG at that of three."""
    trace = run_engine("contact/drop", "pic")
    states = require_value(trace.observed_states)
    hops = shake_upwards(states, steps) * (states.time_s > 1.4)[:, None, None]
    changed = replace(trace, observed_states=replace(states, velocity_m_s=states.velocity_m_s + hops))
    score = compare(solve_pic(trace.scene), changed, sampling=solve_pit(trace.scene, frame_rate_hz=60.0))
    assert require_value(score.contact).grade is grade
    assert require_value(score.contact).quality.hop_m_s == pytest.approx(steps / 6.0)
    assert require_value(score.contact).quality.take_offs == pytest.approx(0.5, abs=0.05)
    assert "hops at" in join_reasons(score)


@each("off, said", [(0.005, "held 0.005 m off its wall"), (-0.005, "held 0.005 m inside its wall")])
def test_constant_gap_or_overlap_in_contact_is_reported(off: float, said: str) -> None:
    """If an engine keeps a disc 5 mm away from its wall, or 5 mm inside the wall, this distance is reported."""
    score = score_altered_states(
        lambda states: move_states(states, states.time_s >= 0.0, place=off), "contact/slide-to-roll"
    )
    assert require_value(score.contact).quality.gap_m == pytest.approx(off)
    assert require_value(score.contact).quality.overlap_m == pytest.approx(-off)
    assert said in join_reasons(score)


@each("until_s, in_time", [(0.5, False), (1.25, True)])
def test_bounces_that_end_too_early_are_reported(until_s: float, in_time: bool) -> None:
    """Bounces that should end at 1.342 s are reported if they end at 0.5 s, and not if they end at 1.25 s."""
    score = score_altered_states(
        lambda states: move_states(states, (states.time_s > until_s) & (states.time_s < 1.342), speed=0.0),
        "contact/drop",
    )
    assert require_value(score.contact).ends_in_time is in_time
    assert (require_value(score.contact).grade is Grade.EXACT) is in_time
    assert ("bounces end" in join_reasons(score)) is not in_time


def test_slip_that_ends_late_is_reported() -> None:
    """A disc that should roll from 0.5 s on, but slips until 1 s, is reported with slip ending 0.5 s late."""

    def slipping(states: States) -> States:
        late = (states.time_s > 0.4) & (states.time_s < 1.0)
        return replace(states, spin_rad_s=np.where(late[:, None], 0.0, require_value(states.spin_rad_s)))

    score = score_altered_states(slipping, "contact/slide-to-roll")
    assert require_value(score.contact).late.slips_s == pytest.approx(0.5, abs=0.1)
    assert "slips end" in join_reasons(score)


def test_half_step_of_an_integrator_is_explained() -> None:
    """A position error of v dt / 2 is reported as an integrator's half step, and is SAMPLED."""
    velocity = require_value(run_engine("contact/stops", "pic").observed_states).velocity_m_s
    late = 0.5 / 60.0 * (velocity - velocity[0])  # the disc is first seen at 2.9 m/s
    score = score_altered_states(lambda states: replace(states, position_m=states.position_m + late), "contact/stops")
    assert require_value(score.contact).errors.place_m == pytest.approx(0.5 / 60.0 * 2.9, rel=1e-9)
    assert require_value(score.contact).beyond_m < 1e-12
    assert require_value(score.contact).grade is Grade.SAMPLED
    assert "moving a disc at one speed in each step explains" in join_reasons(score)


def test_creeping_of_a_resting_disc_is_reported() -> None:
    """A disc that creeps at 0.01 m/s where friction holds it is reported with that speed."""
    creep = np.array([0.008, -0.006])
    score = score_altered_states(
        lambda states: replace(states, velocity_m_s=states.velocity_m_s + creep), "contact/holds"
    )
    assert "a disc that should rest moves at 0.01 m/s on average" in join_reasons(score)


@each("restitution", release_after(1, [0.2, 0.8, 0.95]))
def test_pit_of_a_ball_coming_to_rest_is_no_worse_than_sampled(restitution: float) -> None:
    """PIT of a ball that should come to rest is SAMPLED, CLOSE or EXACT for any restitution of the floor."""
    for height in (1.0, 1.013):
        scene = CONTACT["contact/drop"]
        disc = scene.discs[0].model_copy(update={"position_m": (0.0, 0.5 + height), "velocity_m_s": (0.0, 0.0)})
        lasts = math.sqrt(height / 5.0) * (1.0 + restitution) / (1.0 - restitution) + 2.0
        scene = scene.model_copy(update={"discs": (disc,), "wall_restitution": restitution, "duration_s": lasts})
        trace = observe_run(load_adapter("pit"), scene, "tuned", 1 / 60)
        score = compare(solve_pic(scene), trace, sampling=solve_pit(scene, frame_rate_hz=60.0))
        assert require_value(score.contact).grade in {Grade.SAMPLED, Grade.CLOSE, Grade.EXACT}, score.findings
        assert score.grade in {Grade.SAMPLED, Grade.CLOSE, Grade.EXACT}, score.findings


def test_nan_position_in_contact_is_wrong() -> None:
    """NaN as positions in contact makes the run WRONG."""
    score = score_altered_states(
        lambda states: replace(states, position_m=np.full_like(states.position_m, math.nan)), "contact/stops"
    )
    assert score.grade is Grade.WRONG


def test_no_contact_score_without_contact_or_states() -> None:
    """There is no contact score if the reference has no contact, or the trace no states."""
    (entry,) = find_scenes(["gravity/bouncing-ball"])
    trace = observe_run(load_adapter("pic"), entry.scene, "tuned", 1 / 60)
    assert compare(solve_pic(entry.scene), trace).contact is None
    scene = CONTACT["contact/drop"]
    assert compare(solve_pic(scene), solve_pic(scene)).contact is None


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
