"""Recommended step sizes, and `carom.advise` from Python."""

import math
import re
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from tests.cases import each
from tests.in_process_pool import InProcessPool
from tests.scene_builders import disc_at, require_value, staged, wall_at, with_discs
from tests.unit.report.test_terminal import print_as_line

import carom
from carom import Scene, Trace, solve_pic, solve_pit
from carom.comparator.shifted_scenes import shift_start
from carom.errors import InputError
from carom.execution.job import PIT_METHOD, Job, Method
from carom.execution.observation.engine_run import observe_run
from carom.model.trace import Outcome
from carom.model.walls import Leg
from carom.studies.advise import run as adviser
from carom.studies.advise.api import ShownAdvice
from carom.studies.advise.document import build_advice_document
from carom.studies.advise.options import AdviceOptions
from carom.studies.advise.run import Advice, ReferenceCut, advise, find_closed_form
from carom.studies.advise.sampling_limit import Cause, rank_hardest_impacts
from carom.studies.advise.step_trial import StartTask

DEGREE = math.radians(1)


def build_pair(
    miss: float = 0.3, speed: float = 1.0, radius: float = 0.5, mass: float = 1.0, restitution: float = 1.0
) -> Scene:
    """Two discs, the second off centre by `miss`."""
    first, second = disc_at(0, 0, speed, 0, r=radius, m=mass), disc_at(4 * radius, miss, r=radius)
    return staged("pair", first, second, restitution=restitution, duration_s=6 * radius / speed)


def measure_direction_error(scene: Scene, dt_s: float, lateness: float) -> tuple[int, float]:
    """Impacts that PIT finds, and its worst direction error, where a look falls `lateness` after the contact."""
    at = float(solve_pic(scene).impacts["time_s"][0])
    found = solve_pit(shift_start(scene, -(at + lateness) % dt_s), frame_rate_hz=1 / dt_s).impacts
    expected = solve_pic(scene).impacts[0]
    worst = 0.0
    for impact in found[:1]:
        for name in ("velocity_first_after", "velocity_second_after"):
            (a, b), (c, d) = impact[name], expected[name]
            worst = max(worst, abs(math.atan2(a * d - b * c, a * c + b * d)))
    return len(found), worst


def ask(scene: Scene, engines: list[str], direction_error_rad: float = DEGREE, **options: Any) -> Advice:
    """Return the advice on a scene, from engines in this process."""
    return advise(scene, AdviceOptions(engines, direction_error_rad=direction_error_rad, **options), InProcessPool())


@each(
    "scene, degrees",
    [
        (build_pair(0.3), 1.0),
        (build_pair(0.7, mass=5.0), 1.0),
        (build_pair(0.05, speed=20, radius=0.05), 1.0),
        (build_pair(0.5, mass=0.2, restitution=0.5), 5.0),
        (build_pair(-0.6, mass=3.0, restitution=0.0), 0.5),
        (build_pair(0.4, speed=3.0, restitution=0.25), 30.0),
    ],
)
def test_pit_fails_just_above_the_closed_form_step(scene: Scene, degrees: float) -> None:
    """With a step 0.1 % below the closed form, PIT meets the demand at 5 phases; 0.1 % above, one phase fails."""
    demand = degrees * DEGREE
    limit = rank_hardest_impacts(solve_pic(scene), AdviceOptions(direction_error_rad=demand))[0]
    for share in (0.001, 0.25, 0.5, 0.75, 0.999):
        found, worst = measure_direction_error(scene, limit.dt_s * 0.999, limit.dt_s * 0.999 * share)
        assert found == 1
        assert worst <= demand
    found, worst = measure_direction_error(scene, limit.dt_s * 1.001, limit.dt_s * 1.0005)
    assert found == 0 or worst > demand


def test_share_of_missed_grazes_matches_contact_window() -> None:
    """The contact window of a graze is sqrt(R² - b²) / v; with twice that step, PIT misses half of 20 phases."""
    scene = build_pair(0.999)
    window_s = math.sqrt(1 - 0.999**2)
    trace, dt_s = solve_pic(scene), 2 * window_s
    hard = rank_hardest_impacts(trace, AdviceOptions(direction_error_rad=math.radians(90)))[0]
    assert hard.cause is Cause.GRAZE
    assert hard.miss_dt_s == pytest.approx(window_s, rel=1e-9)
    half = rank_hardest_impacts(trace, AdviceOptions(direction_error_rad=math.radians(90), miss_probability=0.5))[0]
    assert half.miss_dt_s == pytest.approx(dt_s, rel=1e-9)
    assert sum(measure_direction_error(scene, dt_s, dt_s * (k + 0.5) / 20)[0] for k in range(20)) == 10


WALLED = staged("walled", disc_at(0, 0, 1, 0), wall_at(2, 0, -1, 0), duration_s=3.0)


@each(
    "scene, degrees, cause, step_s",
    [
        (build_pair(1e-9, speed=100, radius=0.01), 90.0, Cause.FAST, 0.02 / 100),
        (WALLED, 1.0, Cause.WALL, math.inf),
        ("driven/paddle", 1.0, Cause.WALL, None),
        ("driven/swatter", 1.0, Cause.EDGE, None),
    ],
)
def test_hardest_impact_has_its_cause_and_step(
    scene: Scene | str, degrees: float, cause: Cause, step_s: float | None
) -> None:
    """For a fast small disc the cause is speed; a half-plane allows any step, and a swatter is an edge."""
    hard = rank_hardest_impacts(solve_pic(scene), AdviceOptions(direction_error_rad=degrees * DEGREE))[0]
    assert hard.cause is cause
    assert step_s is None or hard.dt_s == pytest.approx(step_s)


@pytest.mark.long
def test_unsupported_method_and_refused_steps_are_not_run() -> None:
    """A profile that does not support the scene, and steps that Box2D refuses, are not run and no failures."""
    for module in ("Box2D", "pybullet"):
        pytest.importorskip(module, reason=f"{module} is not installed")
    advice = ask(build_pair(speed=150.0), ["box2d", "pybullet"], 10 * DEGREE, profiles=["default"], phases=1)
    (found,) = advice.answers
    assert list(advice.unable) == [Method("pybullet", "default")]
    assert "150 m/s" in advice.unable[Method("pybullet", "default")]
    refused_s = require_value(found.refused_s)
    assert refused_s * 150 >= 2.0
    assert found.trials
    assert all(trial.dt_s < refused_s and not trial.reason for trial in found.trials)


@pytest.mark.long
def test_scene_is_cut_where_rounding_becomes_decisive(monkeypatch: pytest.MonkeyPatch) -> None:
    """The scene ends before the first impact beyond the horizon; if no impact is left, it is refused."""
    scene = staged("walled", disc_at(0, 0, 1, 0), wall_at(2, 0, -1, 0), wall_at(-2, 0, 1, 0), duration_s=9.0)
    times = solve_pic(scene).impacts["time_s"]
    monkeypatch.setattr(adviser, "estimate_horizon", lambda _: float(times[1]))
    advice = ask(scene, ["pit"], phases=1)
    assert (advice.cut, advice.impacts) == (ReferenceCut.CHAOS, 2)
    assert times[1] < advice.scene.duration_s < times[2]
    assert re.search("Only the time up to .*rounding", print_as_line(build_advice_document(advice)))
    monkeypatch.setattr(adviser, "estimate_horizon", lambda _: 0.0)
    words = "no step size can be recommended for 'walled', because from its first impact on, rounding"
    with pytest.raises(InputError, match=words):
        ask(scene, ["pit"])


@pytest.mark.long
def test_scene_is_cut_before_simultaneous_impacts() -> None:
    """The scene ends before a disc meets two others at once; if no impact is left, it is refused."""
    discs = [disc_at(0, 0, -1, 0), disc_at(3, 0.55), disc_at(3, -0.55)]
    tie = staged("tie", *discs, wall_at(-2, 0, 1, 0), duration_s=9.0)
    assert solve_pic(tie).ambiguous == (2,)
    advice = ask(tie, ["pit"], phases=1)
    assert (advice.cut, advice.impacts) == (ReferenceCut.TIE, 1)
    at_once = staged("at once", disc_at(0, 0, 1, 0), *discs[1:], duration_s=9.0)
    with pytest.raises(InputError, match="from its first impact on, a disc meets two others at once"):
        ask(at_once, ["pit"])


@pytest.mark.long
def test_step_of_pit_is_searched_with_friction() -> None:
    """With friction, PIT runs to find PIT's step. The found step meets the demand, and the next larger one does not."""
    rough = Scene(**{**dict(build_pair(0.3)), "friction": 0.5})
    advice = ask(rough, ["pit"], 5 * DEGREE)
    assert advice.answers == ()
    _, passes_s = advice.pit_steps_s
    for step, right in ((passes_s, True), (1.5 * passes_s, False)):
        found, worst = measure_direction_error(rough, step, step * 0.999)
        assert (found == 1 and worst <= 5 * DEGREE) is right
    text = print_as_line(build_advice_document(advice))
    assert "(without friction)" in text
    assert f", {1 / passes_s:.4g} steps/s for 5°." in text


@pytest.mark.long
def test_closed_form_ignores_spin_and_excludes_curved_paths() -> None:
    """Without friction, spin does not change the closed form; with gravity or a driven disc there is none."""

    def closed_form(scene: Scene) -> tuple[float, float] | None:
        return find_closed_form(scene, rank_hardest_impacts(solve_pic(scene), AdviceOptions()))

    pair = build_pair()
    plain, spinning = (closed_form(scene) for scene in (pair, with_discs(pair, spin_rad_s=2.0)))
    assert require_value(plain) == spinning == ask(pair, ["pit"]).pit_steps_s
    hung = [pair.discs[0], pair.discs[1].model_copy(update={"mass_kg": math.inf})]
    legs = (Leg(from_s=0.0, velocity_m_s=(0.0, 0.0)), Leg(from_s=1.2, velocity_m_s=(0.1, 0.0)))
    driven = [hung[0], hung[1].model_copy(update={"driven": True, "legs": legs})]
    for changes in ({"discs": hung, "gravity_m_s2": (0.0, -0.1)}, {"discs": driven}):
        assert closed_form(Scene(**{**dict(pair), **changes})) is None


def test_impact_in_last_step_is_decided() -> None:
    """A start task finds an impact just before the scene's end, which PIT on the scene itself does not reach."""
    scene = build_pair()
    at = float(solve_pic(scene).impacts["time_s"][0])
    short = Scene(**{**dict(scene), "duration_s": at * (1 + 1e-6)})
    assert solve_pit(short, frame_rate_hz=20).impacts.size == 0
    found = StartTask(Job(short, PIT_METHOD, 0.05)).carry_out()
    assert not found.is_lost
    assert 0.0 < found.direction_error_rad < math.inf


def test_run_that_ends_early_counts_as_lost(monkeypatch: pytest.MonkeyPatch) -> None:
    """A start whose run stops before its end counts as lost, although it finds the impact."""

    def stop_early(*args: Any, **options: Any) -> Trace:
        return replace(observe_run(*args, **options), outcome=Outcome.STOPPED)

    monkeypatch.setattr("carom.studies.advise.step_trial.observe_run", stop_early)
    found = StartTask(Job(build_pair(), PIT_METHOD, 0.05)).carry_out()
    assert found.is_lost
    assert not math.isnan(found.direction_error_rad)


@pytest.fixture(scope="module")
def advice() -> ShownAdvice:
    """Pymunk's steps for two discs, confirmed at four phases."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("carom.studies.advise.step_search.CONFIRM", 4)
        return carom.advise("paper/late", ["pymunk"], profiles=["tuned"], phases=1, pool=InProcessPool())


def test_advice_prints_answer_first_and_settings_code(advice: ShownAdvice) -> None:
    """The first printed line of `carom.advise` is the rate that misses no impact; the settings code is included."""
    (answer,) = advice.answers
    rate = 1.0 / require_value(answer.never_misses.largest_passing).dt_s
    assert repr(advice).splitlines()[0].startswith(f"paper/late: to miss no impact, use {rate:.4g} steps/s ")
    assert advice.code[answer.method] in repr(advice)


def test_advice_plot_has_one_line_per_method_and_the_target(advice: ShownAdvice) -> None:
    """The plot shows a line per method with its rates, and a level line at the target; HTML contains an SVG."""
    pytest.importorskip("matplotlib", reason="matplotlib, extra report, is not installed")
    from matplotlib.figure import Figure

    axes = advice.plot(Figure().add_subplot())
    found = {str(line.get_label()): line for line in axes.lines}
    rates = [1.0 / trial.dt_s for trial in advice.answers[0].trials if not math.isnan(trial.direction_error_rad)]
    assert np.asarray(found["pymunk tuned"].get_xdata()) == pytest.approx(rates)
    assert np.asarray(found["target: 1°"].get_ydata()) == pytest.approx([1.0, 1.0])
    page = require_value(advice._repr_html_())
    assert "<svg" in page
    assert "to miss no impact" in page
