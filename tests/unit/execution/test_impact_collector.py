import dataclasses
import math
from typing import NamedTuple

import numpy as np
import pytest
from numpy.typing import NDArray
from tests.cases import each
from tests.scene_builders import disc_at, staged, sure, wall_at

from carom import Disc, Scene, Wall
from carom.engines.api import Contact, Observation
from carom.execution.impact_collector import ImpactCollector

DT = 0.1
ALONG_X = (1.0, 0.0)


def state(*discs: tuple[float, float], contacts: tuple[Contact, ...] = ()) -> Observation:
    """Discs on the x axis, each as (x, velocity along x)."""
    position = np.array([(x, 0.0) for x, _ in discs])
    velocity = np.array([(v, 0.0) for _, v in discs])
    return Observation(position, velocity, contacts)


def scene_of(start: Observation) -> Scene:
    discs = [disc_at(*p, *v, r=0.1) for p, v in zip(start.position_m, start.velocity_m_s, strict=True)]
    return staged("line", *discs, wall_at(9, 0, -1, 0), duration_s=1)


class Collected(NamedTuple):
    """What comes of a run, and what collected it."""

    impacts: NDArray[np.void]
    effective: NDArray[np.float64]
    collector: ImpactCollector

    @property
    def met(self) -> list[tuple[float, int, int]]:
        return [(float(one["time_s"]), int(one["first"]), int(one["second"])) for one in self.impacts]


def collect(start: Observation, *steps: Observation, scene: Scene | None = None, float_bits: int = 64) -> Collected:
    """Return what is collected of the states after each step of `DT`, of a scene or of discs on a line."""
    collector = ImpactCollector(scene or scene_of(start), start, float_bits)
    for k, step in enumerate(steps, start=1):
        collector.add(k * DT, step)
    return Collected(*collector.finish(), collector)


def test_a_contact_of_several_steps_is_one_impact() -> None:
    """A soft contact that acts in three steps is one impact, from the velocity before the first to after the last."""
    start = state((0.0, 1.0), (1.0, 0.0))
    touch = (Contact(0, 1, 0.0, ALONG_X, impulse_n_s=0.4),)
    (impact,) = collect(
        start,
        state((0.10, 0.6), (1.0, 0.4), contacts=touch),
        state((0.15, 0.3), (1.05, 0.7), contacts=(Contact(0, 1, 0.1, ALONG_X, 0.3),)),
        state((0.15, 0.0), (1.15, 1.0), contacts=(Contact(0, 1, 0.2, ALONG_X, 0.3),)),
        state((0.15, 0.0), (1.25, 1.0)),
    ).impacts
    assert impact["time_s"] == 0.0
    assert impact["velocity_first_before"].tolist() == [1.0, 0.0]
    assert impact["velocity_second_after"].tolist() == [1.0, 0.0]


@each("turned, float_bits, known", [(1e-15, 64, False), (1e-9, 64, True), (1e-9, 32, False)])
def test_paths_that_turned_by_rounding_alone_meet_nowhere(turned: float, float_bits: int, known: bool) -> None:
    """An impact that is undone leaves a velocity's last bits changed: where such lines meet is no time of anything."""
    start = state((0.0, 1.0), (0.21, 0.0))
    pushed = state((0.09, 1.0 - turned), (0.22, turned), contacts=(Contact(0, 1, 0.0, ALONG_X, impulse_n_s=1.0),))
    assert math.isfinite(collect(start, pushed, float_bits=float_bits).effective[0]) == known


def test_a_contact_whose_pushes_cancel_has_the_normal_of_its_first() -> None:
    """Pushed to and fro by as much in two steps: they have no direction together."""
    there, back = ((Contact(0, 1, 0.0, (sign, 0.0), impulse_n_s=0.5),) for sign in (1.0, -1.0))
    start = state((0.0, 1.0), (0.25, 0.0))
    (impact,) = collect(
        start, state((0.1, 0.5), (0.2, 0.5), contacts=there), state((0.1, 1.0), (0.2, 0.0), contacts=back)
    ).impacts
    assert impact["normal"].tolist() == [1.0, 0.0]


def test_a_pair_that_parts_and_is_pushed_to_one_speed_is_still_in_one_contact() -> None:
    """Only what is driven together again by a third body is another impact: at one speed nothing is."""
    first = (Contact(0, 1, 0.0, ALONG_X, impulse_n_s=0.75),)
    both = Contact(1, 2, 0.1, ALONG_X, impulse_n_s=0.5), Contact(0, 1, 0.1, ALONG_X, impulse_n_s=0.25)
    found = collect(
        state((0.0, 1.0), (0.25, 0.0), (0.5, 0.0)),
        state((0.1, 0.25), (0.2, 0.75), (0.4, 0.0), contacts=first),
        state((0.1, 0.0), (0.2, 0.5), (0.4, 0.5), contacts=both),
    )
    assert found.met == [(0.0, 0, 1), (0.1, 1, 2)]


def test_a_contact_of_zero_impulse_is_no_impact() -> None:
    """A contact that an engine reports but that did nothing does not count."""
    start = state((0.0, 1.0), (1.0, 0.0))
    idle = state((0.1, 1.0), (1.0, 0.0), contacts=(Contact(0, 1, 0.0, ALONG_X, 0.0),))
    assert collect(start, idle).met == []


def test_without_impulses_a_change_of_velocity_decides() -> None:
    """Where an engine tells no impulse, a contact counts if a velocity changed in its step."""
    start = state((0.0, 1.0), (1.0, 0.0))
    idle = state((0.1, 1.0), (1.0, 0.0), contacts=(Contact(0, 1, 0.0, ALONG_X),))
    hit = state((0.1, 0.0), (1.1, 1.0), contacts=(Contact(0, 1, 0.1, ALONG_X),))
    assert collect(start, idle, hit).met == [(0.1, 0, 1)]


def test_two_contacts_of_one_disc_in_one_step_are_told_apart_by_their_impulses() -> None:
    """In a chain resolved within one step, the middle disc's velocities are those between its two impacts.

    The states before do not have the positions of the two, but the step stays known.
    """
    start = state((0.0, 1.0), (1.0, 0.0), (2.0, 0.0))
    contacts = (Contact(0, 1, 0.0, ALONG_X, 1.0), Contact(1, 2, 0.0, ALONG_X, 1.0))
    impacts, effective, collector = found = collect(start, state((0.0, 0.0), (1.0, 0.0), (2.1, 1.0), contacts=contacts))
    assert found.met == [(0.0, 0, 1), (0.0, 1, 2)]
    assert impacts[0]["velocity_second_after"].tolist() == [1.0, 0.0]
    assert impacts[1]["velocity_first_before"].tolist() == [1.0, 0.0]
    assert impacts[1]["velocity_first_after"].tolist() == [0.0, 0.0]
    assert np.isnan(effective).all()  # no free flight between the two: nothing to meet
    assert collector.states["time_s"].tolist() == [0.0, 0.0]
    assert np.isnan(collector.states["position_first"]).all()


@each("turned", [(1.0, 0.0), (0.0, -1.0)])
def test_a_pair_pushed_together_again_by_a_third_body_collides_twice(turned: tuple[float, float]) -> None:
    """A pair that had bounced off and approaches again at the next step is a second impact, not the first going on."""

    def along(seen: Observation) -> Observation:
        """Turn what moves along x, as one sees it who moves along it at 4 m/s."""
        place, speed = (np.outer(rows, turned) for rows in (seen.position_m[:, 0], seen.velocity_m_s[:, 0] + 4.0))
        contacts = tuple(dataclasses.replace(one, normal=turned) for one in seen.contacts)
        return dataclasses.replace(seen, position_m=place, velocity_m_s=speed, contacts=contacts)

    start = state((0.0, 1.0), (1.0, 0.0), (2.0, -3.0))
    first = (Contact(0, 1, 0.0, ALONG_X, 1.0), Contact(1, 2, 0.0, ALONG_X, 4.0))
    second = (Contact(0, 1, 0.1, ALONG_X, 3.0),)
    steps = (
        state((0.0, 0.0), (0.7, -3.0), (2.1, 1.0), contacts=first),
        state((-0.3, -3.0), (0.7, 0.0), (2.2, 1.0), contacts=second),
    )
    found = collect(*map(along, (start, *steps)))
    assert found.met == [(0.0, 0, 1), (0.0, 1, 2), (0.1, 0, 1)]


@each("turn_s", [0.0125, 0.05, 0.0875])
def test_the_effective_time_is_where_the_path_turned(turn_s: float) -> None:
    """Free-flight lines that meet at an instant within the step give it back; of a disc at a wall, its own two."""
    start = state((0.0, 2.0), (1.0, -1.0))
    left = 2.0 * turn_s - 1.0 * (DT - turn_s)
    right = 1.0 - 1.0 * turn_s + 2.0 * (DT - turn_s)
    found = collect(start, state((left, -1.0), (right, 2.0), contacts=(Contact(0, 1, DT, ALONG_X, 3.0),)))
    assert found.impacts["time_s"].tolist() == [DT]
    # Positions of order 1 rounded to half an ulp, divided by a relative velocity change of 6.
    assert found.effective[0] == pytest.approx(turn_s, abs=4 * math.ulp(1.0))
    thrown = state((2.0 * turn_s - 2.0 * (DT - turn_s), -2.0), contacts=(Contact(0, -1, 0.0, ALONG_X, 4.0),))
    assert collect(state((0.0, 2.0)), thrown).effective[0] == pytest.approx(turn_s, abs=4 * math.ulp(1.0))


def test_a_method_that_knows_the_velocities_is_taken_at_its_word() -> None:
    """A contact with velocities is an impact without changes, also several of one pair in one step."""
    start = state((0.0, 1.0), (1.0, 0.0))
    velocities = ((1.0, 0.0), (0.0, 0.0), (0.0, 0.0), (1.0, 0.0))
    twice = (Contact(0, 1, 0.01, ALONG_X, None, velocities), Contact(0, 1, 0.05, ALONG_X, None, velocities))
    assert collect(start, state((0.1, 0.0), (1.0, 1.0), contacts=twice)).met == [(0.01, 0, 1), (0.05, 0, 1)]


def test_the_normal_of_several_steps_is_that_along_which_they_push_together() -> None:
    """A contact whose normal turns while it lasts has the normal of the sum of its impulses."""
    start = state((0.0, 1.0), (1.0, 0.0))
    first, second = (0.8, 0.6), (0.6, 0.8)
    (impact,) = collect(
        start,
        state((0.1, 0.5), (1.0, 0.3), contacts=(Contact(0, 1, 0.0, first, 3.0),)),
        state((0.1, 0.2), (1.1, 0.6), contacts=(Contact(0, 1, 0.1, second, 1.0),)),
        state((0.1, 0.2), (1.2, 0.6)),
    ).impacts
    expected = (np.array(first) * 3.0 + np.array(second)) / math.hypot(3.0, 2.6)
    assert impact["normal"].tolist() == pytest.approx(expected.tolist(), rel=1e-15)


def test_no_contacts_give_empty_arrays_of_the_right_kind() -> None:
    """A run without impacts has an empty impact array with all its fields."""
    impacts, effective, _ = collect(state((0.0, 1.0)))
    assert len(impacts) == len(effective) == 0
    assert "time_s" in (impacts.dtype.names or ())


#: Impulses J n + T t on the second: disc 1 receives (2, 1) from disc 0 and gives (2, -0.5) to disc 2; each takes
#: T / (k m R) = 4 T off both spins.
_RUBBED = (Contact(0, 1, 0.0, ALONG_X, 2.0, None, 1.0), Contact(1, 2, 0.0, ALONG_X, 2.0, None, -0.5))
_AFTER = [(1.0, -1.0), (0.0, 1.5), (2.0, -0.5)]
_SPUN = [-4.0, -4.0 + 2.0, 2.0]


def rubbed(*contacts: Contact) -> Collected:
    """Return what is collected of a disc of k = 1/2 between two others, all three in line, that rub in one step."""
    discs = [Disc(position_m=(float(x), 0.0), radius_m=0.5) for x in (0, 1, 2)]
    place = np.array([disc.position_m for disc in discs])
    start = Observation(place, np.array([(3.0, 0.0), (0.0, 0.0), (0.0, 0.0)]), (), spin_rad_s=np.zeros(3))
    after = Observation(place, np.array(_AFTER), contacts, spin_rad_s=np.array(_SPUN))
    return collect(start, after, scene=Scene(name="rough", discs=discs, friction=0.5, duration_s=1))


def test_contacts_that_rub_in_one_step_are_told_apart_by_both_impulses() -> None:
    """Velocity and spin of the middle disc between two impacts of a step are what the first one's impulses gave."""
    impacts, _, collector = rubbed(*_RUBBED)
    assert impacts[0]["velocity_second_after"].tolist() == [2.0, 1.0]
    assert impacts[1]["velocity_first_before"].tolist() == [2.0, 1.0]
    assert impacts[1]["velocity_first_after"].tolist() == [0.0, 1.5]
    assert sure(collector.spins).tolist() == [(0.0, 0.0, -4.0, -4.0), (-4.0, 0.0, -2.0, 2.0)]


def test_without_its_tangential_impulse_a_contact_that_rubs_tells_no_velocity_between() -> None:
    """A push alone does not say what a rough contact did: what is known then is the end of the step."""
    contacts = [dataclasses.replace(contact, tangential_impulse_n_s=None) for contact in _RUBBED]
    impacts, *_ = rubbed(*contacts)
    assert impacts[0]["velocity_second_after"].tolist() == [0.0, 1.5]


G = 9.81


def landing(fall_s: float, slid: float = 0.0, restitution: float = 0.0, lasts: int = 1) -> Collected:
    """A ball that falls onto a floor at `fall_s` at 1 m/s aside, and rests there, or is thrown up after some steps.

    While it rests, friction takes `slid` of its speed aside a step.
    """
    drop = G * fall_s * fall_s / 2
    disc = Disc(position_m=(0.0, 0.1 + drop), velocity_m_s=(1.0, 0.0), radius_m=0.1)
    floor = Wall(point_m=(0, 0), normal=(0, 1))
    scene = Scene(name="landing", discs=[disc], walls=[floor], duration_s=2, gravity_m_s2=(0, -G), wall_restitution=0)
    seen, aside = [], 1.0
    for k in range(1, 20):
        t = k * DT
        down, touches = t - fall_s, t > fall_s
        aside -= slid if touches else 0.0
        if not touches:
            y, v = 0.1 + drop - G * t * t / 2, -G * t
        else:
            y, v = 0.1, restitution * G * fall_s if down > (lasts - 1) * DT else 0.0
        contact = (Contact(0, -1, t - DT, (0.0, -1.0), impulse_n_s=1.0),) if touches and v == 0.0 else ()
        if touches and v and down <= lasts * DT:
            contact = (Contact(0, -1, t - DT, (0.0, -1.0), impulse_n_s=1.0),)
        seen.append(Observation(np.array([[t, y]]), np.array([[aside, v]]), contact))
    start = Observation(np.array([disc.position_m]), np.array([disc.velocity_m_s]))
    return collect(start, *seen, scene=scene)


@each("fall_s", [0.41, 0.55, 0.5999])
def test_a_ball_that_lands_and_rests_has_struck_where_it_landed(fall_s: float) -> None:
    """A contact that gravity holds to the end of the run ends its impact where it rests: the instant is the landing."""
    assert landing(fall_s).effective == pytest.approx([fall_s], abs=8 * math.ulp(1.0))


def test_what_friction_takes_at_rest_is_no_part_of_the_impact() -> None:
    """A ball that lands, and then slides more and more slowly, leaves its impact as fast as it began to slide."""
    assert landing(0.55, slid=0.01).impacts["velocity_first_after"].tolist() == [[0.99, 0.0]]


def test_a_soft_contact_that_throws_back_is_not_ended_where_it_turns() -> None:
    """A contact that stands still at one boundary and then throws the ball back ends with what it throws it back at."""
    (impact,) = landing(0.55, restitution=0.5, lasts=2).impacts
    assert impact["velocity_first_after"][1] == 0.5 * G * 0.55


@each("acts_at_end", [False, True])
def test_velocities_of_discs_that_fall_together_are_those_of_their_impact(acts_at_end: bool) -> None:
    """Before and after an impact discs are as fast as they fell until then, whichever end of a step it acts at.

    Two equal discs meet head-on at 1 m/s each and exchange their velocities at 0.3 s, a boundary: just then both have
    fallen to -0.3 g, before and after alike. The state that follows is that of 0.3 s, or of 0.4 s.
    """
    discs = [Disc(position_m=(x, 0.0), velocity_m_s=(v, 0.0), radius_m=0.1) for x, v in ((-0.4, 1.0), (0.4, -1.0))]
    scene = Scene(name="pair", discs=discs, gravity_m_s2=(0.0, -G), duration_s=1.0)
    start = Observation(np.array([(-0.4, 0.0), (0.4, 0.0)]), np.array([(1.0, 0.0), (-1.0, 0.0)]))
    seen = []
    for k in range(1, 8):
        t = k * DT
        turned = k >= (3 if acts_at_end else 4)
        x, v = (0.1 + (t - 0.3), 1.0) if t > 0.3 + 1e-9 else (0.4 - t, 1.0 if turned else -1.0)
        fall, speed = -G * t * t / 2, -G * t
        touches = k == (3 if acts_at_end else 4)
        contact = (Contact(0, 1, t, ALONG_X, impulse_n_s=1.0),) if touches else ()
        seen.append(Observation(np.array([[-x, fall], [x, fall]]), np.array([[-v, speed], [v, speed]]), contact))
    impacts, effective, _ = collect(start, *seen, scene=scene)
    assert effective == pytest.approx([0.3], abs=1e-15)
    for field, across in (("first_before", 1.0), ("second_before", -1.0), ("first_after", -1.0), ("second_after", 1.0)):
        assert impacts[0][f"velocity_{field}"] == pytest.approx((across, -0.3 * G), abs=8 * math.ulp(1.0))
