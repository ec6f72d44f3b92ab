"""What an adapter declares of units, widths, coefficients and margins is what the checks hold it to, and no less."""

import math
import shutil
import subprocess
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, TypeVar
from xml.etree import ElementTree

import numpy as np
import pytest
from tests.cases import each
from tests.installed_adapters import write_distribution
from tests.scene_builders import disc_at, staged, wall_at
from tests.unit.conformance.toy_page_engine import Bouncer, BouncerWorld

from carom.comparator.thresholds import THRESHOLDS
from carom.conformance import adapter_under_test, probes
from carom.conformance.adapter_under_test import Subject
from carom.conformance.cases import list_cases
from carom.conformance.contact_margin import solve_thickened, thicken_scene
from carom.conformance.known_answers import CATALOGUE_SCENES
from carom.conformance.violation import NotApplicable, Setup, Violation
from carom.engines.api import Accuracy, Adapter, Capabilities, Setting, World
from carom.engines.api.checks import MANTISSA_BITS
from carom.engines.registry import load_adapter
from carom.execution import adapter_profile
from carom.execution.job import Task
from carom.execution.shared_options import LimitOptions
from carom.model.scene import Scene
from carom.solvers.pic import solve_pic

T = TypeVar("T")

#: Returns why an adapter fails a case, "" where it passes, and "skipped: " with the reason where it does not apply.
Held = Callable[[Adapter, str], str]

MARGIN = 0.02


class Here(Subject):
    """An adapter that is run in this process."""

    def __init__(self, adapter: Adapter) -> None:
        super().__init__("pit", LimitOptions())
        self.name, self.adapter = adapter.name, adapter

    def _ask(self, task: Task[T], setup: Setup) -> T:  # noqa: ARG002 - the method's own signature
        return task.carry_out()


@pytest.fixture
def run_case(monkeypatch: pytest.MonkeyPatch) -> Held:
    """The cases of an adapter that no entry point leads to."""
    subjects = dict[int, Here]()

    def found(adapter: Adapter, name: str) -> str:
        def load(asked: str) -> Adapter:
            return adapter if asked == adapter.name else load_adapter(asked)

        for module in (probes, adapter_profile, adapter_under_test):
            monkeypatch.setattr(module, "load_adapter", load)
        here = subjects.setdefault(id(adapter), Here(adapter))
        case = next(case for case in list_cases(here) if case.name == name)
        if case.skip:
            return f"skipped: {case.skip}"
        try:
            case.run(here)
        except NotApplicable as reason:
            return f"skipped: {reason}"
        except Violation as violation:
            return str(violation)
        return ""

    return found


def round_to_float32(value: Setting) -> Setting:
    """Return a setting as an engine of 32-bit floats has it."""
    return float(np.float32(value)) if isinstance(value, float) else value


def build_inexact_reader(units: float) -> Callable[[Setting], Setting]:
    """Return an engine that is off by a number of units in the last place of 32 bits."""
    return lambda value: value * (1 + units * 2.0**-23) if isinstance(value, float) else value


@each(
    "read, bits, passes",
    [
        (round_to_float32, 32, True),
        (round_to_float32, 64, False),
        (build_inexact_reader(3), 32, False),
        (build_inexact_reader(2.0**-29), 64, False),
    ],
)
def test_settings_must_be_exact_to_declared_float_width(
    read: Callable[[Setting], Setting], bits: int, passes: bool, run_case: Held
) -> None:
    """Settings that an engine reads back must equal the requested ones to rounding in its float width."""
    said = run_case(Bouncer(read=read, capabilities=Capabilities(float_bits=bits)), "settings[tuned]")
    assert (said == "") is passes
    assert passes or "differs from the requested one" in said


@each("unit", [1.0, 100.0, 1 / 3])
def test_start_rounded_by_unit_conversion_passes(unit: float, run_case: Held) -> None:
    """A start that is off only by the rounding of a conversion of units passes."""
    assert run_case(Bouncer(unit=unit), "start[tuned]") == ""


def test_start_off_by_three_roundings_fails(run_case: Held) -> None:
    """A start whose coordinates are off by three roundings (3 · 2^-53) fails."""
    assert "starts differently from the scene" in run_case(Bouncer(nudge=3 * 2.0**-53), "start[tuned]")


@each("bits, shove, passes", [(32, 3e-4, False), (32, 3e-6, True), (64, 3e-6, False)])
def test_velocity_error_above_rounding_fails(bits: int, shove: float, passes: bool, run_case: Held) -> None:
    """A velocity error of 3e-4 fails with 32 bits; 3e-6 passes with 32 bits and fails with 64 bits."""
    engine = Bouncer(shove=shove, capabilities=Capabilities(restitution=(0.0, 1.0), float_bits=bits))
    for case in ("restitution[greatest-greatest]", "velocities[tuned-classics/head-on]"):
        said = run_case(engine, case)
        assert (said == "") is passes
        assert passes or "wrong velocit" in said


@each("bits", MANTISSA_BITS)
def test_suite_and_reports_use_the_same_rounding_threshold(bits: int) -> None:
    """The suite and the reports use the same threshold for rounding: 1e-5 with 32 bits, 1e-12 with 64 bits."""
    suite = Here(Bouncer(capabilities=Capabilities(float_bits=bits))).rounding
    assert suite == THRESHOLDS.rounding_of(bits) == {32: 1e-5, 64: 1e-12}[bits]


ONE = Capabilities(restitution=(0.0, 1.0), restitution_combine="one")


def test_single_restitution_for_discs_and_walls_must_be_declared(run_case: Held) -> None:
    """An engine without a restitution of walls must declare this, and must refuse scenes with two."""
    unlike, alike = "restitution[least-greatest]", "restitution[middle-middle]"
    refused = "refuses[restitution-of-walls]"
    assert "ends with a wrong velocity" in run_case(Bouncer(one_coefficient=True), unlike)
    honest = Bouncer(one_coefficient=True, capabilities=ONE)
    assert "combines coefficients by 'one'" in run_case(honest, unlike)
    assert run_case(honest, unlike).startswith("skipped: wall_restitution is 1 with a restitution of 0")
    assert (run_case(honest, alike), run_case(honest, refused)) == ("", "")
    assert "is run" in run_case(replace(honest, refuses=False), refused)
    assert run_case(Bouncer(), refused).startswith("skipped")


@pytest.mark.long
def test_declared_margin_allows_errors_of_a_contact_margin(run_case: Held) -> None:
    """A speculative engine passes with its contact margin declared, and not with half of it or none."""
    names = [f"{check}[tuned-{name}]" for check in ("hits", "times", "velocities") for name in CATALOGUE_SCENES[:12]]
    failed = {}
    for promised in (0.0, MARGIN / 2, MARGIN):
        bouncer = Bouncer(margin_m=MARGIN, accuracy=Accuracy(margin_m=promised))
        said = {name: run_case(bouncer, name) for name in names}
        failed[promised] = [name for name, words in said.items() if words and not words.startswith("skipped")]
    assert "hits[tuned-classics/miss]" in failed[0.0]
    assert len(failed[0.0]) > 10
    assert failed[MARGIN / 2]
    assert failed[MARGIN] == []


def test_declared_margin_allows_no_wrong_restitution(run_case: Held) -> None:
    """A declared contact margin does not allow wrong velocities after an impact with the wrong restitution."""

    class Dull(Bouncer):
        def prepare(self, scene: Scene, settings: Mapping[str, Setting]) -> BouncerWorld:
            return super().prepare(scene.model_copy(update={"restitution": 0.5}), settings)

    said = run_case(Dull(accuracy=Accuracy(margin_m=MARGIN)), "velocities[tuned-classics/oblique-3-4-5]")
    assert "leaves wrong velocities" in said


@each("offset", [0.0, 0.3, 0.6, 0.9])
def test_thickened_discs_have_closed_form_errors(offset: float) -> None:
    """In thickened discs the errors of time and velocities are their closed forms, and grow with the margin."""
    e, masses, speed, gap = 0.75, (1.0, 3.0), 5.0, 2.0
    discs = disc_at(-gap, 0.0, speed, m=masses[0]), disc_at(0.0, offset, m=masses[1])
    scene = staged("offset", *discs, restitution=e, duration_s=1.0)
    true = solve_pic(scene)
    reach = [math.sqrt((1 + m) ** 2 - offset**2) for m in (0.0, MARGIN)]
    angle = [math.asin(offset / (1 + m)) for m in (0.0, MARGIN)]
    thick = solve_thickened(scene, MARGIN)
    early_s = true.impacts["time_s"][0] - thick.impacts["time_s"][0]
    assert early_s == pytest.approx((reach[1] - reach[0]) / speed, rel=1e-12)
    for body, mass in enumerate(masses):
        change = (1 + e) * masses[0] * masses[1] / sum(masses) / mass * speed
        found = math.dist(true.final_velocity_m_s[body], thick.final_velocity_m_s[body])
        assert found == pytest.approx(change * math.sin(angle[0] - angle[1]), rel=1e-9, abs=1e-15)
        less = math.dist(true.final_velocity_m_s[body], solve_thickened(scene, MARGIN / 2).final_velocity_m_s[body])
        assert less <= found


def test_thickening_keeps_inertia_and_wall_impacts_are_early() -> None:
    """A thickened disc keeps its moment of inertia and hits a wall one margin early."""
    scene = staged("wall", disc_at(0.0, 0.0, 1.0, m=2.0), wall_at(1.5, 7.0, -1.0, 0.0), duration_s=2.0)
    thick = thicken_scene(scene, MARGIN).discs[0]
    assert thick.inertia_factor * thick.radius_m**2 == pytest.approx(0.5 * 0.25, rel=1e-15)
    assert solve_pic(thicken_scene(scene, MARGIN)).impacts["time_s"][0] == pytest.approx(1.0 - MARGIN, rel=1e-12)


def restage(change: Callable[[Scene], dict[str, Any]]) -> Callable[[Scene], Scene]:
    """Return what gives a scene other discs or walls."""
    return lambda scene: scene.model_copy(update=change(scene))


POST = disc_at(0, 0, r=2.5, m=math.inf)
#: What adapters do with walls that are otherwise than declared, the case that finds it, and the words for it.
LIES_ABOUT_WALLS: dict[str, tuple[str, Callable[[Scene], Scene], str]] = {
    "a wall from one side": ("edges", restage(lambda _: {"walls": (wall_at(0, 0, 1, 0),)}), "an edge: disc 0"),
    "a post and no container": (
        "circles",
        restage(lambda scene: {"discs": (*scene.discs, POST), "walls": ()}),
        "a circle: disc 0",
    ),
    "one material": (
        "wall-materials",
        restage(lambda scene: {"walls": tuple(wall.model_copy(update={"restitution": None}) for wall in scene.walls)}),
        "walls with different restitutions: disc 1",
    ),
}


@each("lie", LIES_ABOUT_WALLS)
def test_false_statement_about_walls_fails_its_case(lie: str, run_case: Held) -> None:
    """PIT passes each case about walls; with walls other than declared it fails, with the expected message."""
    pit = load_adapter("pit")
    case, staged, words = LIES_ABOUT_WALLS[lie]

    class Lying:
        name = "pit"
        engine, capabilities, profiles = pit.engine, pit.capabilities, pit.profiles

        def prepare(self, scene: Scene, settings: Mapping[str, Setting]) -> World:
            return pit.prepare(staged(scene), settings)

    assert run_case(pit, case) == ""
    assert f"{words} ends with a wrong velocity" in run_case(Lying(), case)


Pytest = Callable[..., "subprocess.CompletedProcess[str]"]

HERE = Path(__file__).parent

#: For each toy, the cases that find its false statement, and the required words.
LIES: Mapping[tuple[str, str], str] = {
    ("one-friction", "friction[sliding-greatest]"): "disc 2 ends with a wrong velocity",
    ("one-friction", "friction[greatest-least]"): "disc 2 ends with a wrong velocity",
    ("spheres", "inertia[hoop]"): "inertia factor 1: disc 0 ends with a wrong velocity",
    ("spheres", "inertia[unturnable]"): "inertia factor inf: disc 0 ends with a wrong velocity",
    ("spheres", "inertia[least]"): "disc 0 ends with a wrong velocity",
    ("clamps", "greatest-spin"): "the spin of a free disc changes in step 0",
    ("damps", "greatest-spin"): "the spin of a free disc changes in step 1",
    ("clockwise", "greatest-spin"): "-100000 rad/s",
    ("clockwise", "friction[least-sliding]"): "ends with a wrong spin",
    ("tells-none", "greatest-spin"): "no spins are reported",
    ("turns-rubs", "rubbing[tuned]"): "do not explain the velocity change",
    ("doubles-rubs", "rubbing[tuned]"): "do not explain the velocity change",
    ("rough", "rubbing[tuned]"): "is too large",
    ("rough", "friction[sliding-sliding]"): "ends with a wrong velocity",
    ("hides", "rubbing[tuned]"): "but no contact is reported",
    ("claims-nothing", "refuses[spin]"): "because the adapter declares spin = False",
    ("claims-nothing", "refuses[friction]"): "because the adapter declares friction = (0.0, 0.0)",
    ("claims-limits", "refuses[fast-spin]"): "because the adapter declares max_spin_rad_s = 10",
    ("claims-limits", "refuses[friction-below-the-range]"): "because the adapter declares friction = (0.01, 5.0)",
    ("claims-limits", "refuses[friction-above-the-range]"): "because the adapter declares friction = (0.01, 5.0)",
    ("claims-limits", "refuses[small-inertia]"): "because the adapter declares min_inertia_factor = 0.1",
    ("claims-limits", "refuses[tangential-restitution]"): "because the adapter declares tangential_restitution = False",
    ("claims-turns", "refuses[turn]"): "because the adapter declares max_turn_rad = 1",
}


@pytest.fixture
def outcomes(project: Path, run_pytest: Pytest) -> Mapping[tuple[str, str], str]:
    """What is said of each case that fails, and "" of each that does not."""
    site = project.parent / "site"
    shutil.copy(HERE / "carom_spin_toys.py", site)
    names = sorted({name for name, _ in LIES} | {"honest"})
    write_distribution(site, "carom-spin-toys", {name: f"carom_spin_toys:{name.replace('-', '_')}" for name in names})
    lies = " or ".join(f"({name} and {case.partition('[')[0]})" for name, case in LIES)
    chosen = f"({lies} or honest) and (friction or inertia or spin or rubbing or turn or tangential)"
    run_pytest("--carom-engine", "carom-spin-toys", "--carom-profile", "tuned", "--junitxml", "out.xml", "-k", chosen)
    found = {}
    for case in ElementTree.parse(project / "out.xml").iter("testcase"):  # noqa: S314 - written a moment ago
        engine = case.get("classname", "").rpartition(".")[2]
        said = "".join(failure.text or "" for failure in case.iter("failure"))
        found[engine, case.get("name", "")] = said
    return found


@pytest.mark.long
def test_false_statements_about_spin_fail_their_cases(outcomes: Mapping[tuple[str, str], str]) -> None:
    """Each false statement about spin or friction fails its case, and no honest adapter fails."""
    for lie, words in LIES.items():
        assert words in outcomes[lie], (lie, outcomes[lie])
    honest = {case: said for (name, case), said in outcomes.items() if name == "honest"}
    assert not any(honest.values()), honest
    assert {case.partition("[")[0] for _, case in LIES} <= {case.partition("[")[0] for case in honest}
