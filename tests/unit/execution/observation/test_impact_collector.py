import dataclasses
import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import pytest
from numpy.typing import NDArray
from tests.cases import each
from tests.scene_builders import disc_at, require_value, staged, wall_at

from carom import Scene
from carom.engines.api import Contact, Observation
from carom.execution.observation.impact_collector import ImpactCollector

DT = 0.1
ALONG_X = (1.0, 0.0)


def build_state(*discs: tuple[float, float], contacts: tuple[Contact, ...] = ()) -> Observation:
    """Discs on the x axis, each as (x, velocity along x)."""
    position = np.array([(x, 0.0) for x, _ in discs])
    return Observation(position, np.array([(v, 0.0) for _, v in discs]), contacts)


def build_line_scene(start: Observation) -> Scene:
    discs = [disc_at(*p, *v, r=0.1) for p, v in zip(start.position_m, start.velocity_m_s, strict=True)]
    return staged("line", *discs, wall_at(9, 0, -1, 0), duration_s=1)


class Collected(NamedTuple):
    """The impacts of a run, and the effective time, the state before and the spins of each."""

    impacts: NDArray[np.void]
    effective: NDArray[np.float64]
    states: NDArray[np.void]
    spins: NDArray[np.void] | None

    @property
    def times_and_bodies(self) -> list[tuple[float, int, int]]:
        return [(float(one["time_s"]), int(one["first"]), int(one["second"])) for one in self.impacts]


def collect(start: Observation, *steps: Observation, scene: Scene | None = None, float_bits: int = 64) -> Collected:
    """Return what is collected of the states after each step of `DT`, of a scene or of discs on a line."""
    collector = ImpactCollector(scene or build_line_scene(start), start, float_bits)
    for k, step in enumerate(steps, start=1):
        collector.add(k * DT, step)
    return Collected(*collector.finish())


def test_contact_over_several_steps_is_one_impact() -> None:
    """A soft contact is one impact: velocities from before and after it, and the direction of the summed impulses."""
    first, second = (0.8, 0.6), (0.6, 0.8)
    (impact,) = collect(
        build_state((0.0, 1.0), (1.0, 0.0)),
        build_state((0.10, 0.6), (1.0, 0.4), contacts=(Contact(0, 1, 0.0, first, impulse_n_s=3.0),)),
        build_state((0.15, 0.3), (1.05, 0.7), contacts=(Contact(0, 1, 0.1, second, 0.5),)),
        build_state((0.15, 0.0), (1.15, 1.0), contacts=(Contact(0, 1, 0.2, second, 0.5),)),
        build_state((0.15, 0.0), (1.25, 1.0)),
    ).impacts
    assert impact["time_s"] == 0.0
    assert impact["velocity_first_before"].tolist() == [1.0, 0.0]
    assert impact["velocity_second_after"].tolist() == [1.0, 0.0]
    expected = (np.array(first) * 3.0 + np.array(second)) / math.hypot(3.0, 2.6)
    assert impact["normal"].tolist() == pytest.approx(expected.tolist(), rel=1e-15)


@each("turned, float_bits, known", [(1e-15, 64, False), (1e-9, 64, True), (1e-9, 32, False)])
def test_velocity_change_within_rounding_has_no_effective_time(turned: float, float_bits: int, known: bool) -> None:
    """If velocities change only by rounding of the declared floats, the effective time is NaN."""
    start = build_state((0.0, 1.0), (0.21, 0.0))
    pushed = build_state((0.09, 1.0 - turned), (0.22, turned), contacts=(Contact(0, 1, 0.0, ALONG_X, impulse_n_s=1.0),))
    assert math.isfinite(collect(start, pushed, float_bits=float_bits).effective[0]) == known


def test_contact_with_cancelling_impulses_has_its_first_normal() -> None:
    """Opposite impulses in two steps have no common direction, so the impact has the first contact's normal."""
    there, back = ((Contact(0, 1, 0.0, (sign, 0.0), impulse_n_s=0.5),) for sign in (1.0, -1.0))
    turns = [build_state((0.1, 0.5), (0.2, 0.5), contacts=there), build_state((0.1, 1.0), (0.2, 0.0), contacts=back)]
    (impact,) = collect(build_state((0.0, 1.0), (0.25, 0.0)), *turns).impacts
    assert impact["normal"].tolist() == [1.0, 0.0]


def test_separating_pair_pushed_to_one_speed_has_one_impact() -> None:
    """A separating pair that a third disc pushes to one speed does not approach, so it has no second impact."""
    first = (Contact(0, 1, 0.0, ALONG_X, impulse_n_s=0.75),)
    both = Contact(1, 2, 0.1, ALONG_X, impulse_n_s=0.5), Contact(0, 1, 0.1, ALONG_X, impulse_n_s=0.25)
    found = collect(
        build_state((0.0, 1.0), (0.25, 0.0), (0.5, 0.0)),
        build_state((0.1, 0.25), (0.2, 0.75), (0.4, 0.0), contacts=first),
        build_state((0.1, 0.0), (0.2, 0.5), (0.4, 0.5), contacts=both),
    )
    assert found.times_and_bodies == [(0.0, 0, 1), (0.1, 1, 2)]


def test_contact_is_an_impact_only_with_an_impulse_or_a_changed_velocity() -> None:
    """A contact of zero impulse, or of none in a step without a changed velocity, is not counted as an impact."""
    start = build_state((0.0, 1.0), (1.0, 0.0))
    for impulse, found in ((0.0, []), (None, [(0.1, 0, 1)])):
        idle = build_state((0.1, 1.0), (1.0, 0.0), contacts=(Contact(0, 1, 0.0, ALONG_X, impulse),))
        hit = build_state((0.1, 0.0), (1.1, 1.0), contacts=(Contact(0, 1, 0.1, ALONG_X, impulse),))
        assert collect(start, idle).times_and_bodies == []
        assert collect(start, idle, hit).times_and_bodies == found


def test_impulses_separate_two_contacts_in_one_step() -> None:
    """In a chain resolved in one step, the middle disc's velocities are those between its two impacts."""
    start = build_state((0.0, 1.0), (1.0, 0.0), (2.0, 0.0))
    contacts = (Contact(0, 1, 0.0, ALONG_X, 1.0), Contact(1, 2, 0.0, ALONG_X, 1.0))
    after = build_state((0.0, 0.0), (1.0, 0.0), (2.1, 1.0), contacts=contacts)
    impacts, effective, states, _ = found = collect(start, after)
    assert found.times_and_bodies == [(0.0, 0, 1), (0.0, 1, 2)]
    assert impacts[0]["velocity_second_after"].tolist() == [1.0, 0.0]
    assert impacts[1]["velocity_first_before"].tolist() == [1.0, 0.0]
    assert impacts[1]["velocity_first_after"].tolist() == [0.0, 0.0]
    assert np.isnan(effective).all()  # no free flight between the two: nothing to meet
    assert states["time_s"].tolist() == [0.0, 0.0]
    assert np.isnan(states["position_first"]).all()


@each("turned", [(1.0, 0.0), (0.0, -1.0)])
def test_pair_driven_together_again_has_two_impacts(turned: tuple[float, float]) -> None:
    """A pair that a third disc drives together again has a second impact, in any frame and direction."""

    def along(seen: Observation) -> Observation:
        """Turn what moves along x, as one sees it who moves along it at 4 m/s."""
        place, speed = (np.outer(rows, turned) for rows in (seen.position_m[:, 0], seen.velocity_m_s[:, 0] + 4.0))
        contacts = tuple(dataclasses.replace(one, normal=turned) for one in seen.contacts)
        return dataclasses.replace(seen, position_m=place, velocity_m_s=speed, contacts=contacts)

    start = build_state((0.0, 1.0), (1.0, 0.0), (2.0, -3.0))
    first = (Contact(0, 1, 0.0, ALONG_X, 1.0), Contact(1, 2, 0.0, ALONG_X, 4.0))
    second = (Contact(0, 1, 0.1, ALONG_X, 3.0),)
    steps = (
        build_state((0.0, 0.0), (0.7, -3.0), (2.1, 1.0), contacts=first),
        build_state((-0.3, -3.0), (0.7, 0.0), (2.2, 1.0), contacts=second),
    )
    assert collect(*map(along, (start, *steps))).times_and_bodies == [(0.0, 0, 1), (0.0, 1, 2), (0.1, 0, 1)]


@each("turn_s", [0.0125, 0.05, 0.0875])
def test_effective_time_is_where_the_paths_turned(turn_s: float) -> None:
    """The effective time is where the free-flight lines before and after meet, at a wall the disc's own two."""
    start = build_state((0.0, 2.0), (1.0, -1.0))
    left = 2.0 * turn_s - 1.0 * (DT - turn_s)
    right = 1.0 - 1.0 * turn_s + 2.0 * (DT - turn_s)
    found = collect(start, build_state((left, -1.0), (right, 2.0), contacts=(Contact(0, 1, DT, ALONG_X, 3.0),)))
    assert found.impacts["time_s"].tolist() == [DT]
    # Positions of order 1 rounded to half an ulp, divided by a relative velocity change of 6.
    assert found.effective[0] == pytest.approx(turn_s, abs=4 * math.ulp(1.0))
    thrown = build_state((2.0 * turn_s - 2.0 * (DT - turn_s), -2.0), contacts=(Contact(0, -1, 0.0, ALONG_X, 4.0),))
    assert collect(build_state((0.0, 2.0)), thrown).effective[0] == pytest.approx(turn_s, abs=4 * math.ulp(1.0))


#: Impulses J n + T t on the second: disc 1 receives (2, 1) from disc 0 and gives (2, -0.5) to disc 2; each takes
#: T / (k m R) = 4 T off both spins.
_RUBBED = (Contact(0, 1, 0.0, ALONG_X, 2.0, None, 1.0), Contact(1, 2, 0.0, ALONG_X, 2.0, None, -0.5))
_AFTER = [(1.0, -1.0), (0.0, 1.5), (2.0, -0.5)]
_SPUN = [-4.0, -4.0 + 2.0, 2.0]


def test_both_impulses_separate_rough_contacts_in_one_step() -> None:
    """Velocity and spin between two rough impacts follow from both impulses of the first, if both are reported."""
    scene = staged("rough", *(disc_at(x, 0.0) for x in (0, 1, 2)), friction=0.5, duration_s=1)
    place = scene.arrays.position_m
    start = Observation(place, np.array([(3.0, 0.0), (0.0, 0.0), (0.0, 0.0)]), (), spin_rad_s=np.zeros(3))
    after = Observation(place, np.array(_AFTER), _RUBBED, spin_rad_s=np.array(_SPUN))
    impacts, _, _, spins = collect(start, after, scene=scene)
    assert impacts[0]["velocity_second_after"].tolist() == [2.0, 1.0]
    assert impacts[1]["velocity_first_before"].tolist() == [2.0, 1.0]
    assert impacts[1]["velocity_first_after"].tolist() == [0.0, 1.5]
    assert require_value(spins).tolist() == [(0.0, 0.0, -4.0, -4.0), (-4.0, 0.0, -2.0, 2.0)]
    smooth = tuple(dataclasses.replace(contact, tangential_impulse_n_s=None) for contact in _RUBBED)
    impacts, *_ = collect(start, dataclasses.replace(after, contacts=smooth), scene=scene)
    assert impacts[0]["velocity_second_after"].tolist() == [0.0, 1.5]  # as at the end of the step


G = 9.81


def collect_landing(fall_s: float, slid: float = 0.0, rises: float = 0.0, rebound: float = 0.0) -> Collected:
    """Return what is collected of a ball that falls onto a floor at `fall_s` and moves sideways at 1 m/s.

    In contact, friction takes `slid` of its sideways speed in each step, and it rises at `rises`. With a speed of
    `rebound`, it leaves the floor after two steps in contact.
    """
    drop = G * fall_s * fall_s / 2
    disc, floor = disc_at(0.0, 0.1 + drop, 1.0, 0.0, r=0.1), wall_at(0, 0, 0, 1)
    scene = staged("landing", disc, floor, duration_s=2, gravity_m_s2=(0, -G), wall_restitution=0)
    seen, aside, touched = [], 1.0, 0
    for k in range(1, 20):
        t = k * DT
        y, v, contacts = 0.1 + drop - G * t * t / 2, -G * t, tuple[Contact, ...]()
        if t > fall_s:
            touched, aside = touched + 1, aside - slid
            y, v = 0.1 + rises * (t - fall_s), rebound if rebound and touched > 1 else rises
            if touched <= 2 or not rebound:
                contacts = (Contact(0, -1, t - DT, (0.0, -1.0), impulse_n_s=1.0),)
        seen.append(Observation(np.array([[t, y]]), np.array([[aside, v]]), contacts))
    start = Observation(np.array([disc.position_m]), np.array([disc.velocity_m_s]))
    return collect(start, *seen, scene=scene)


@each("fall_s, rises", [(0.41, 0.0), (0.55, 0.0), (0.5999, 0.0), (0.55, 0.25)])
def test_resting_ball_has_the_effective_time_of_its_landing(fall_s: float, rises: float) -> None:
    """If a ball lands and rests, or rises at 0.25 m/s, which counts as rest, its effective time is that of landing."""
    assert collect_landing(fall_s, rises=rises).effective == pytest.approx([fall_s], abs=8 * math.ulp(1.0))


def test_friction_after_a_landing_is_not_part_of_the_impact() -> None:
    """A ball that lands and is then slowed by friction leaves its impact at 0.99 m/s, its first sliding speed."""
    assert collect_landing(0.55, slid=0.01).impacts["velocity_first_after"].tolist() == [[0.99, 0.0]]


def test_soft_bounce_ends_with_the_rebound_velocity() -> None:
    """A contact with zero velocity after one step and a rebound after the next ends with the rebound velocity."""
    (impact,) = collect_landing(0.55, rebound=2.5).impacts
    assert impact["velocity_first_after"][1] == 2.5


@each("acts_at_end", [False, True])
def test_falling_discs_have_the_velocities_of_their_impact(acts_at_end: bool) -> None:
    """The velocities of an impact include the fall up to its instant, whichever step reports the contact."""
    discs = (disc_at(-0.4, 0.0, 1.0, r=0.1), disc_at(0.4, 0.0, -1.0, r=0.1))
    scene = staged("pair", *discs, gravity_m_s2=(0.0, -G), duration_s=1.0)
    start = Observation(scene.arrays.position_m, scene.arrays.velocity_m_s)
    seen = []
    for k in range(1, 8):
        t = k * DT
        turned = k >= (3 if acts_at_end else 4)
        x, v = (0.1 + (t - 0.3), 1.0) if t > 0.3 + 1e-9 else (0.4 - t, 1.0 if turned else -1.0)
        fall, speed = -G * t * t / 2, -G * t
        contact = (Contact(0, 1, t, ALONG_X, impulse_n_s=1.0),) if (k == (3 if acts_at_end else 4)) else ()
        seen.append(Observation(np.array([[-x, fall], [x, fall]]), np.array([[-v, speed], [v, speed]]), contact))
    impacts, effective, *_ = collect(start, *seen, scene=scene)
    assert effective == pytest.approx([0.3], abs=1e-15)
    for field, across in (("first_before", 1.0), ("second_before", -1.0), ("first_after", -1.0), ("second_after", 1.0)):
        assert impacts[0][f"velocity_{field}"] == pytest.approx((across, -0.3 * G), abs=8 * math.ulp(1.0))


@each(
    "law, speed, path",
    [
        ({"damping_per_s": 2.0}, lambda t: math.exp(-2 * t), lambda t: -math.expm1(-2 * t) / 2),
        ({"table_deceleration_m_s2": 2.0}, lambda t: 1 - 2 * t, lambda t: t - t * t),
    ],
)
def test_slowed_discs_have_the_time_and_the_velocities_of_their_impact(
    law: dict[str, float], speed: Callable[[float], float], path: Callable[[float], float]
) -> None:
    r"""Time and velocities of an impact between two steps follow from the law that slows the discs down.

    Two equal discs that start at 1 m/s each meet head-on at 0.25 s and exchange their velocities.
    """
    meets_s, seen = 0.25, []
    for k in range(6):
        gap, turned = path(meets_s) - path(k * DT), k * DT > meets_s
        x, v = 0.1 + abs(gap), speed(k * DT) if turned else -speed(k * DT)
        contact = (Contact(0, 1, (k - 1) * DT, ALONG_X, impulse_n_s=1.0),) if k == 3 else ()
        seen.append(build_state((-x, -v), (x, v), contacts=contact))
    start = seen[0]
    discs = [disc_at(*p, *v, r=0.1) for p, v in zip(start.position_m, start.velocity_m_s, strict=True)]
    impacts, effective, *_ = collect(*seen, scene=staged("pair", *discs, **law, duration_s=1.0))
    assert effective == pytest.approx([meets_s], abs=1e-14)
    for field, sign in (("first_before", 1.0), ("second_before", -1.0), ("first_after", -1.0), ("second_after", 1.0)):
        assert impacts[0][f"velocity_{field}"] == pytest.approx((sign * speed(meets_s), 0.0), abs=1e-14)
