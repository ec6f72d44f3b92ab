from __future__ import annotations

import math
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.stage import disc_at, staged, wall_at

from carom import Scene, resolve_impact, solve_pic, solve_pit
from carom.bench.adviser import RESOLUTION, Cause, Demand, StepTrial, advise, hardest_impacts
from carom.bench.sampling_limit import Window, largest_step, pair_limit
from carom.comparator.shift import begun_earlier
from carom.errors import InputError
from carom.report.document import Medium, Table
from carom.report.small import advice_document
from carom.runs.pool import InProcess
from carom.scenes import find_scenes

DEGREE = math.radians(1)
angles = st.floats(0, math.tau)


def pair(miss: float = 0.3, speed: float = 1.0, radius: float = 0.5, mass: float = 1.0) -> Scene:
    """Two discs, the second off centre by `miss`."""
    return staged(
        "pair",
        disc_at(0, 0, speed, 0, r=radius, m=mass),
        disc_at(4 * radius, miss, r=radius),
        duration_s=6 * radius / speed,
    )


def direction_errors(scene: Scene, dt_s: float, lateness: float) -> tuple[int, float]:
    """Impacts that PIT finds, and its worst direction error, where a look falls `lateness` after the contact."""
    at = float(solve_pic(scene).impacts["time_s"][0])
    found = solve_pit(begun_earlier(scene, -(at + lateness) % dt_s), frame_rate_hz=1 / dt_s).impacts
    expected = solve_pic(scene).impacts[0]
    worst = 0.0
    for impact in found[:1]:
        for name in ("velocity_first_after", "velocity_second_after"):
            (a, b), (c, d) = impact[name], expected[name]
            worst = max(worst, abs(math.atan2(a * d - b * c, a * c + b * d)))
    return len(found), worst


@pytest.mark.long
@given(
    normal=angles,
    course=st.floats(-1.5, 1.5),
    speed=st.floats(0.1, 10),
    frame=st.tuples(st.floats(-3, 3), st.floats(-3, 3)),
    masses=st.tuples(st.floats(0.1, 10), st.floats(0.1, 10)),
    restitution=st.floats(0, 1),
    demanded=st.sampled_from([0.5, 1, 5, 30]),
)
def test_the_closed_form_is_what_a_scan_of_the_overlap_finds(
    normal: float,
    course: float,
    speed: float,
    frame: tuple[float, float],
    masses: tuple[float, float],
    restitution: float,
    demanded: float,
) -> None:
    """Up to the closed form's lateness no direction is wrong by more than asked; just after it, one is."""
    toward = normal + math.pi + course
    n, u = (math.cos(normal), math.sin(normal)), (speed * math.cos(toward), speed * math.sin(toward))
    before = (frame, (frame[0] + u[0], frame[1] + u[1]))
    window, angle = Window.of(1.0, n, u), math.radians(demanded)
    limit = pair_limit(window, before, (1 / masses[0], 1 / masses[1]), restitution, angle, 0.0).direction_dt_s

    def error(late: float) -> float:
        c = (n[0] + u[0] * late, n[1] + u[1] * late)
        turned = (c[0] / math.hypot(*c), c[1] / math.hypot(*c))
        found, right = (
            resolve_impact(before[0], masses[0], before[1], masses[1], direction, restitution=restitution)
            for direction in (turned, n)
        )
        return max(
            abs(math.atan2(a[0] * b[1] - a[1] * b[0], a[0] * b[0] + a[1] * b[1]))
            for a, b in zip(found, right, strict=True)
        )

    end = min(limit, window.length_s)
    assert all(error(end * k / 100) <= angle + 1e-6 for k in range(100))
    if limit < window.length_s * (1 - 1e-6):
        assert error(limit + 1e-7 * window.length_s) >= angle - 1e-5


@pytest.mark.parametrize("scene", [pair(0.3), pair(0.7, mass=5.0), pair(0.05, speed=20, radius=0.05)])
def test_one_step_above_fails_and_one_below_passes(scene: Scene) -> None:
    """PIT's closed form, run: at its step every start meets the demand, and a step 0.1 % larger has one that fails."""
    limit = hardest_impacts(solve_pic(scene), Demand(DEGREE))[0].limit
    for share in (0.001, 0.25, 0.5, 0.75, 0.999):
        found, worst = direction_errors(scene, limit.dt_s * 0.999, limit.dt_s * 0.999 * share)
        assert found == 1
        assert worst <= DEGREE
    found, worst = direction_errors(scene, limit.dt_s * 1.001, limit.dt_s * 1.0005)
    assert found == 0 or worst > DEGREE


def test_a_graze_is_missed_as_often_as_its_window_says() -> None:
    """A graze's window is sqrt(R^2 - b^2) / v; at twice that step, half of all starts miss, as PIT run shows."""
    scene = pair(0.999)
    window_s = math.sqrt(1 - 0.999**2)
    hard = hardest_impacts(solve_pic(scene), Demand(math.radians(90)))[0]
    assert hard.cause is Cause.GRAZE
    assert hard.limit.miss_dt_s == pytest.approx(window_s, rel=1e-9)
    dt_s = 2 * window_s
    assert largest_step(window_s, 0.5) == pytest.approx(dt_s)
    found = [direction_errors(scene, dt_s, dt_s * (k + 0.5) / 20)[0] for k in range(20)]
    assert sum(found) == 10


def test_a_fast_small_disc_is_called_that_and_a_wall_is_no_hurdle() -> None:
    """Near head-on, what ends the window is speed and size; a wall's window has no end."""
    fast = hardest_impacts(solve_pic(pair(1e-9, speed=100, radius=0.01)), Demand(math.radians(90)))[0]
    assert fast.cause is Cause.FAST
    assert fast.limit.dt_s == pytest.approx(0.02 / 100)
    walled = staged("walled", disc_at(0, 0, 1, 0), wall_at(2, 0, -1, 0), duration_s=3.0)
    assert hardest_impacts(solve_pic(walled), Demand(DEGREE))[0].limit.dt_s == math.inf


def test_an_engines_answer_stands_between_a_step_that_passes_and_one_that_fails() -> None:
    """Search and closed form agree: tuned pymunk does what PIT does, whose closed form is confirmed by running it."""
    pytest.importorskip("pymunk", reason="pymunk is not installed")
    with InProcess() as pool:
        advice = advise(pair(0.4), Demand(DEGREE), pool, ["pit", "pymunk"], profiles=["tuned"], phases=2, budget_s=300)
    pit, pymunk = advice.answers
    assert advice.closed_form_s is not None
    assert pit.reason == ""
    for answer in (pit, pymunk):
        assert answer.passes is not None
        assert answer.fails is not None
        assert answer.passes.direction_error_rad <= DEGREE < answer.fails.direction_error_rad
        assert answer.fails.dt_s <= answer.passes.dt_s * RESOLUTION * (1 + 1e-6)
    assert pymunk.passes is not None
    assert pymunk.passes.dt_s == pytest.approx(advice.closed_form_s, rel=0.02)


def test_what_cannot_take_a_large_step_is_asked_for_a_smaller_one() -> None:
    """Box2D moves nothing by more than 2 m a step: at 5 m/s it can't take the first, 0.5 s, and has an answer."""
    pytest.importorskip("Box2D", reason="Box2D is not installed")
    (entry,) = find_scenes(["spin/grip"])
    with InProcess() as pool:
        advice = advise(entry.scene, Demand(DEGREE), pool, ["box2d"], profiles=["tuned"], phases=2, budget_s=300)
    (answer,) = advice.answers
    assert answer.reason == ""
    assert answer.passes is not None
    assert answer.fails is not None
    assert answer.passes.direction_error_rad <= DEGREE < answer.fails.direction_error_rad
    refused = StepTrial(0.5, False, math.nan, False, math.nan, "unsupported: too far a step", unsupported=True)
    (section,) = advice_document(replace(advice, answers=(replace(answer, fails=refused),))).sections
    (table,) = (block for block in section.blocks if isinstance(block, Table))
    assert [cell.text for cell in table.shown(Medium.DETAIL)[1][0]][-3:] == [
        "0.5",
        "n/a",
        "unsupported: too far a step",
    ]


@pytest.mark.parametrize(
    ("demand", "words"),
    [
        ((0.0,), "direction error must be above 0"),
        ((math.nan,), "got nan degrees"),
        ((math.pi,), "below 180 degrees, got 180"),
        ((DEGREE, 1.0), "miss probability must be 0 or more and below 1, got 1"),
        ((DEGREE, -0.1), "got -0.1"),
    ],
)
def test_a_demand_that_is_none_is_refused(demand: tuple[float, ...], words: str) -> None:
    """A demand out of range is refused by name and value before anything runs."""
    with pytest.raises(InputError, match=words):
        Demand(*demand)


def test_with_friction_steps_are_tried() -> None:
    """Two discs that rub have no closed form; at the step found PIT is right, run, and at the next one it is not."""
    rough = Scene(**{**dict(pair(0.3)), "friction": 0.5})
    advice = advise(rough, Demand(DEGREE), InProcess(), ["pit"])
    assert advice.closed_form_s is None
    (answer,) = advice.answers
    assert answer.passes is not None
    assert answer.fails is not None
    assert answer.reason == ""
    assert answer.fails.dt_s <= answer.passes.dt_s * RESOLUTION * (1 + 1e-6)
    for step, right in ((answer.passes.dt_s, True), (answer.fails.dt_s, False)):
        found, worst = direction_errors(rough, step, step * 0.999)
        assert (found == 1 and worst <= DEGREE) is right
    assert "were there no friction" in " ".join(advice_document(advice).lead)


def test_a_spin_that_rubs_on_nothing_is_no_matter() -> None:
    """Discs that spin and do not rub have the closed form of those that do not spin."""
    discs = [disc.model_copy(update={"spin_rad_s": 2.0}) for disc in pair().discs]
    spinning = Scene(**{**dict(pair()), "discs": discs})
    steps = [advise(scene, Demand(DEGREE), InProcess(), ["pit"]).closed_form_s for scene in (pair(), spinning)]
    assert steps[0] == steps[1]
