"""The score of contact: what is exact, what looking once a step explains, and that planted faults are found."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from tests.lengths import long_after

from carom import Trace, compare, solve_pic, solve_pit
from carom.comparator import Grade, Verdict
from carom.comparator.compare import Score
from carom.comparator.contact import motion_at
from carom.registry import load_adapter
from carom.runs.observe import observe_run
from carom.runs.wire import CarriedTrace, Codec
from carom.scenes import find_scenes
from carom.trace import SPIN_DTYPE
from carom.windows import States

CONTACT = {entry.name: entry.scene for entry in find_scenes(["contact"]) if any(entry.scene.gravity_m_s2)}


def judged(name: str, engine: str, dt_s: float = 1 / 60) -> tuple[Trace, Score]:
    """Return a run of a scene by Carom's own methods, and its score."""
    scene = CONTACT[name]
    trace = observe_run(load_adapter(engine), scene, "tuned", dt_s)
    return trace, compare(solve_pic(scene), trace, sampling=solve_pit(scene, frame_rate_hz=round(1 / dt_s)))


def doctored(change: Callable[[States], States], name: str) -> Score:
    """Return the score of PIC with states that are not its own."""
    trace, _ = judged(name, "pic")
    assert trace.looks is not None
    return compare(solve_pic(CONTACT[name]), replace(trace, looks=change(trace.looks)))


@pytest.mark.parametrize("name", list(CONTACT))
def test_pic_is_exact_in_contact(name: str) -> None:
    """What it is at each step is what the closed form is, to rounding."""
    _, score = judged(name, "pic")
    assert score.contact is not None
    assert score.contact.grade is Grade.EXACT
    assert score.grade is Grade.EXACT
    assert score.contact.looks >= 30


@pytest.mark.parametrize("dt_s", long_after(1, [1 / 60, 1 / 240]))
@pytest.mark.parametrize("name", list(CONTACT))
def test_pit_is_no_worse_than_sampled_in_contact(name: str, dt_s: float) -> None:
    """It knows no contact, and hops from frame to frame: that is what looking once a step costs."""
    _, score = judged(name, "pit", dt_s)
    assert score.contact is not None
    assert score.contact.grade in {Grade.SAMPLED, Grade.CLOSE, Grade.EXACT}, score.findings
    assert score.grade in {Grade.SAMPLED, Grade.CLOSE, Grade.EXACT}, score.findings


@pytest.mark.parametrize("name", list(CONTACT))
def test_the_motion_of_a_trace_is_that_of_the_run(name: str) -> None:
    """Places, velocities and spins read off a trace at any time are those of a run that ends then."""
    trace = solve_pic(CONTACT[name])
    times = np.sort(np.random.default_rng(3).uniform(0.0, trace.end_time_s, 12))
    motion = motion_at(trace, times)
    for row, time_s in enumerate(times.tolist()):
        there = solve_pic(CONTACT[name], until_s=time_s)
        assert motion.position_m[row] == pytest.approx(there.final_position_m, abs=1e-13)
        assert motion.velocity_m_s[row] == pytest.approx(there.final_velocity_m_s, abs=1e-12)
        if there.final_spin_rad_s is not None and motion.spin_rad_s is not None:
            assert motion.spin_rad_s[row] == pytest.approx(there.final_spin_rad_s, abs=1e-12)


def test_places_that_are_off_by_more_than_pit_s_are_inaccurate() -> None:
    """PIT, which takes a look to begin to rub, ends a sixth of a metre too far: a fifth is more."""
    aside = np.array([0.2, 0.0])
    score = doctored(lambda looks: replace(looks, position_m=looks.position_m + aside), "contact/slide-to-roll")
    assert score.contact is not None
    assert score.contact.pit is not None
    assert score.contact.pit.place_m == pytest.approx(1 / 6, rel=0.01)
    assert score.grade is Grade.INACCURATE
    assert Verdict.CONTACT in score.verdicts


def test_a_disc_that_stands_still_where_it_moves_is_wrong() -> None:
    """Frozen in its first state, it is wrong, and the reason says so."""

    def frozen(looks: States) -> States:
        return replace(looks, velocity_m_s=np.zeros_like(looks.velocity_m_s))

    score = doctored(frozen, "contact/slide-to-roll")
    assert score.contact is not None
    assert score.contact.frozen
    assert score.grade is Grade.WRONG
    assert any("stands still where it moves" in finding.reason for finding in score.findings)


@pytest.mark.parametrize(("steps", "grade"), [(2.0, Grade.INACCURATE), (3.0, Grade.WRONG)])
def test_a_disc_that_does_not_come_to_rest_is_wrong(steps: float, grade: Grade) -> None:
    """Three steps' fall of jitter is no rest any more; two are, and too much where PIT's is as much as one."""

    def shaken(looks: States) -> States:
        shake = steps * 10.0 / 60.0 * (-1.0) ** np.arange(len(looks))
        return replace(looks, velocity_m_s=looks.velocity_m_s + shake[:, None, None] * np.array([0.0, 1.0]))

    score = doctored(shaken, "contact/stops")
    assert score.grade is grade
    assert any("where it rests" in finding.reason for finding in score.findings)


def test_a_spin_that_damping_eats_shows_in_the_angular_momentum() -> None:
    """A rim that is slower by a tenth is off by half as much in ``u - k R w``, k = 1/2."""

    def slowed(looks: States) -> States:
        assert looks.spin_rad_s is not None
        return replace(looks, spin_rad_s=0.9 * looks.spin_rad_s)

    score = doctored(slowed, "contact/incline-slips")
    assert score.contact is not None
    assert score.contact.momentum_m_s == pytest.approx(0.5 * 0.1 * 3.2, rel=1e-9)
    assert any("angular momentum about the wall" in finding.reason for finding in score.findings)


def test_a_state_that_is_no_number_is_wrong() -> None:
    """NaN passes no comparison."""
    score = doctored(lambda looks: replace(looks, position_m=np.full_like(looks.position_m, math.nan)), "contact/stops")
    assert score.grade is Grade.WRONG


def test_states_go_over_the_wire_and_come_back() -> None:
    """A worker's answer keeps them to the bit."""
    trace, _ = judged("contact/struck", "pic")
    codec = Codec[Trace](CarriedTrace)
    assert codec.loads(codec.dumps(trace)) == trace


def test_of_flight_alone_nothing_is_scored_in_contact() -> None:
    """Without contact in the reference, or without states, there is no such score."""
    (entry,) = find_scenes(["gravity/bouncing-ball"])
    trace = observe_run(load_adapter("pic"), entry.scene, "tuned", 1 / 60)
    assert compare(solve_pic(entry.scene), trace).contact is None
    scene = CONTACT["contact/drop"]
    assert compare(solve_pic(scene), solve_pic(scene)).contact is None


def test_an_impact_reported_where_contact_begins_is_not_invented() -> None:
    """An engine reports what touches: a disc that lies on the floor from the start is no impact too many."""
    trace, _ = judged("contact/stops", "pic")
    touches = solve_pic(CONTACT["contact/drop"]).impacts[:1].copy()
    touches["time_s"] = 0.0
    told = replace(trace, impacts=touches, spins=np.zeros(1, SPIN_DTYPE), effective_time_s=None, state_before=None)
    assert compare(solve_pic(CONTACT["contact/stops"]), told).spurious == ()


def test_an_impact_before_contact_is_invented() -> None:
    """Of a ball that is in the air until half a second has passed, one at a tenth is one too many."""
    scene = CONTACT["contact/drop"]
    trace, _ = judged("contact/drop", "pic")
    early = np.insert(trace.impacts, 0, trace.impacts[0])
    early["time_s"][0] = 0.1
    told = replace(trace, impacts=early, effective_time_s=None, state_before=None)
    assert len(compare(solve_pic(scene), told).spurious) == 1
