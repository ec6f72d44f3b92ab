"""The conformance checks require what an adapter declares of float widths, coefficients, walls, spins and margins."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any, TypeVar

import pytest
from tests.cases import each
from tests.scene_builders import disc_at, staged, wall_at

from carom.comparator.thresholds import THRESHOLDS
from carom.conformance import adapter_under_test, probes
from carom.conformance.adapter_under_test import Subject
from carom.conformance.cases import list_cases
from carom.conformance.contact_margin import solve_thickened, thicken_scene
from carom.conformance.suite_scenes import CATALOGUE_SCENES
from carom.conformance.violation import NotApplicable, Setup, Violation
from carom.engines.api import Accuracy, Adapter, Contact, Disc, Observation, Setting, World, require_supported
from carom.engines.api.checks import MANTISSA_BITS
from carom.engines.registry import load_adapter
from carom.execution import adapter_profile
from carom.execution.job import Task
from carom.execution.shared_options import LimitOptions
from carom.model.scene import Scene
from carom.solvers.pic import solve_pic

T = TypeVar("T")
pytest.importorskip("pymunk")

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


Staged = Callable[[Scene], Scene]
Seen = Callable[[Observation, int], Observation]


def restage(change: Callable[[Scene], dict[str, Any]]) -> Staged:
    """Return a function that replaces fields of a scene."""
    return lambda scene: scene.model_copy(update=change(scene))


def change_discs(change: Callable[[Disc], dict[str, float]]) -> Staged:
    """Return a function that replaces fields of each disc of a scene."""
    return restage(lambda scene: {"discs": tuple(disc.model_copy(update=change(disc)) for disc in scene.discs)})


def change_spins(change: Callable[[Any, int], Any]) -> Seen:
    """Return a function that replaces the observed spins, given the spins and the step."""
    return lambda seen, step: (
        seen if seen.spin_rad_s is None else replace(seen, spin_rad_s=change(seen.spin_rad_s, step))
    )


def scale_friction_impulses(factor: float) -> Seen:
    """Return a function that multiplies the reported impulses of friction."""

    def scaled(contact: Contact) -> Contact:
        return replace(contact, tangential_impulse_n_s=factor * (contact.tangential_impulse_n_s or 0.0))

    return lambda seen, _: replace(seen, contacts=tuple(map(scaled, seen.contacts)))


@dataclass
class Lying:
    """An adapter of pymunk or PIT with changes.

    Attributes:
        base: Name of the adapter whose worlds are run.
        staged: Returns the scene that is run, given the requested scene.
        seen: Returns the observation that is shown, given the true one and the step.
        read: Returns the setting that is shown, given the requested setting.
        accuracy: Declared accuracy of all profiles.
        refuses: Whether scenes beyond the declared capabilities are refused.
        declared: Declared capabilities that differ from those of the base.
    """

    base: str = "pymunk"
    staged: Staged = lambda scene: scene
    seen: Seen = lambda seen, _: seen
    read: Callable[[Setting], Setting] = lambda setting: setting
    accuracy: Accuracy = field(default_factory=Accuracy)
    refuses: bool = False
    declared: Mapping[str, Any] = field(default_factory=dict)
    name: str = "lying"

    def __post_init__(self) -> None:
        adapter = load_adapter(self.base)
        self.engine, self._prepare = adapter.engine, adapter.prepare
        self.profiles = {name: replace(one, accuracy=self.accuracy) for name, one in adapter.profiles.items()}
        self.capabilities = replace(adapter.capabilities, **self.declared)

    def prepare(self, scene: Scene, settings: Mapping[str, Setting]) -> World:
        if self.refuses:
            require_supported(self.name, scene, self.capabilities, float(settings["dt_s"]))
        return LyingWorld(self, self._prepare(self.staged(scene), settings))


class LyingWorld:
    """A world of an adapter with changes."""

    def __init__(self, adapter: Lying, world: World) -> None:
        self._adapter, self._world, self._step = adapter, world, 0
        self.settings = {name: adapter.read(value) for name, value in world.settings.items()}

    def advance(self, steps: int) -> None:
        self._world.advance(steps)
        self._step += steps

    def close(self) -> None:
        self._world.close()

    def observe(self) -> Observation:
        return self._adapter.seen(self._world.observe(), self._step)


def scale_setting(factor: float) -> Callable[[Setting], Setting]:
    """Return a function that multiplies settings that are not whole numbers."""
    return lambda value: value * factor if isinstance(value, float) else value


@each(
    "read, bits, passes",
    [
        (scale_setting(1 + 2.0**-26), 32, True),
        (scale_setting(1 + 2.0**-26), 64, False),
        (scale_setting(1 + 3 * 2.0**-23), 32, False),
        (scale_setting(1 + 2.0**-52), 64, False),
    ],
)
def test_settings_must_be_exact_to_declared_float_width(
    read: Callable[[Setting], Setting], bits: int, passes: bool, run_case: Held
) -> None:
    """Settings that an engine reads back must equal the requested ones to rounding in its float width."""
    message = run_case(Lying(read=read, declared={"float_bits": bits}), "settings[tuned]")
    assert (message == "") is passes
    assert passes or "differs from the requested one" in message


@each("factors, passes", [((100.0, 0.01), True), ((1 / 3, 3.0), True), ((1 + 3 * 2.0**-53, 1.0), False)])
def test_start_may_differ_by_a_rounding_of_units(factors: tuple[float, float], passes: bool, run_case: Held) -> None:
    """A start that is off only by the rounding of a conversion of units passes; one off by three roundings fails."""

    def convert(seen: Observation, _: int) -> Observation:
        return replace(seen, position_m=seen.position_m * factors[0] * factors[1])

    message = run_case(Lying(seen=convert), "start[tuned]")
    assert (message == "") is passes
    assert passes or "starts differently from the scene" in message


@each("bits, error, passes", [(32, 3e-4, False), (32, 3e-6, True), (64, 3e-6, False)])
def test_velocity_error_above_rounding_fails(bits: int, error: float, passes: bool, run_case: Held) -> None:
    """A velocity error of 3e-4 fails with 32 bits; 3e-6 passes with 32 bits and fails with 64 bits."""

    def accelerate(seen: Observation, step: int) -> Observation:
        return replace(seen, velocity_m_s=seen.velocity_m_s * (1 + error * (step > 10)))

    for case in ("restitution[greatest-greatest]", "velocities[tuned-classics/head-on]"):
        message = run_case(Lying(seen=accelerate, declared={"float_bits": bits}), case)
        assert (message == "") is passes, message
        assert passes or "wrong velocit" in message


@each("bits", MANTISSA_BITS)
def test_suite_and_reports_use_the_same_rounding_threshold(bits: int) -> None:
    """The suite and the reports use the same threshold for rounding: 1e-5 with 32 bits, 1e-12 with 64 bits."""
    suite = Here(Lying(declared={"float_bits": bits})).rounding
    assert suite == THRESHOLDS.rounding_of(bits) == {32: 1e-5, 64: 1e-12}[bits]


ONE_RESTITUTION = restage(lambda scene: {"wall_restitution": scene.restitution})


def test_single_restitution_for_discs_and_walls_must_be_declared(run_case: Held) -> None:
    """An engine without a restitution of walls must declare this, and must refuse scenes with two."""
    unlike, alike = "restitution[least-greatest]", "restitution[middle-middle]"
    refused = "refuses[restitution-of-walls]"
    assert "ends with a wrong velocity" in run_case(Lying(staged=ONE_RESTITUTION), unlike)
    honest = Lying(staged=ONE_RESTITUTION, refuses=True, declared={"restitution_combine": "one"})
    assert run_case(honest, unlike).startswith("skipped: wall_restitution is 1 with a restitution of 0")
    assert (run_case(honest, alike), run_case(honest, refused)) == ("", "")
    assert "is run" in run_case(replace(honest, refuses=False), refused)
    assert run_case(Lying(), refused).startswith("skipped")


@pytest.mark.long
def test_declared_margin_allows_errors_of_a_contact_margin(run_case: Held) -> None:
    """An engine with a contact margin passes with its margin declared, and not with half of it or none."""
    names = [f"{check}[tuned-{name}]" for check in ("hits", "times", "velocities") for name in CATALOGUE_SCENES[:12]]
    thicker = change_discs(lambda disc: {"radius_m": disc.radius_m + MARGIN / 2})
    failed = {}
    for promised in (0.0, MARGIN / 2, MARGIN):
        lying = Lying("pit", thicker, accuracy=Accuracy(margin_m=promised))
        said = {name: run_case(lying, name) for name in names}
        failed[promised] = [name for name, words in said.items() if words and not words.startswith("skipped")]
    assert "hits[tuned-classics/miss]" in failed[0.0]
    assert len(failed[0.0]) > 10
    assert failed[MARGIN / 2]
    assert failed[MARGIN] == []


def test_declared_margin_allows_no_wrong_restitution(run_case: Held) -> None:
    """A declared contact margin does not allow wrong velocities after an impact with the wrong restitution."""
    dull = Lying(staged=restage(lambda _: {"restitution": 0.5}), accuracy=Accuracy(margin_m=MARGIN))
    assert "leaves wrong velocities" in run_case(dull, "velocities[tuned-classics/oblique-3-4-5]")


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
    # A thickened disc keeps its moment of inertia, and hits a wall one margin early.
    scene = staged("wall", disc_at(0.0, 0.0, 1.0, m=2.0), wall_at(1.5, 7.0, -1.0, 0.0), duration_s=2.0)
    disc = thicken_scene(scene, MARGIN).discs[0]
    assert disc.inertia_factor * disc.radius_m**2 == pytest.approx(0.5 * 0.25, rel=1e-15)
    assert solve_thickened(scene, MARGIN).impacts["time_s"][0] == pytest.approx(1.0 - MARGIN, rel=1e-12)


POST = disc_at(0, 0, r=2.5, m=math.inf)


@each(
    "case, staged, words",
    [
        ("edges", restage(lambda _: {"walls": (wall_at(0, 0, 1, 0),)}), "an edge: disc 0"),
        ("circles", restage(lambda scene: {"discs": (*scene.discs, POST), "walls": ()}), "a circle: disc 0"),
        (
            "wall-materials",
            restage(lambda s: {"walls": tuple(wall.model_copy(update={"restitution": None}) for wall in s.walls)}),
            "walls with different restitutions: disc 1",
        ),
    ],
)
def test_false_statement_about_walls_fails_its_case(case: str, staged: Staged, words: str, run_case: Held) -> None:
    """PIT passes each case about walls; with walls other than declared it fails, with the expected message."""
    assert run_case(load_adapter("pit"), case) == ""
    assert f"{words} ends with a wrong velocity" in run_case(Lying("pit", staged), case)


HONEST = Lying()
ROUGH = restage(lambda scene: {"friction": 3 * scene.friction, "wall_friction": 3 * scene.wall_friction})
ONE_FRICTION = restage(lambda scene: {"wall_friction": scene.friction})
#: Arguments of `Lying` for pymunk's adapter, the case that finds the false statement, and the words for it.
LIES_ABOUT_SPIN: list[tuple[dict[str, Any], str, str]] = [
    ({"staged": ONE_FRICTION}, "friction[sliding-greatest]", "disc 2 ends with a wrong velocity"),
    ({"staged": change_discs(lambda _: {"inertia_factor": 0.4})}, "inertia[hoop]", "disc 0 ends with a wrong velocity"),
    (
        {"staged": change_discs(lambda disc: {"spin_rad_s": min(disc.spin_rad_s, 50.0)})},
        "greatest-spin",
        "the spin of a free disc changes in step 0",
    ),
    (
        {"seen": change_spins(lambda spins, step: spins * 0.99**step)},
        "greatest-spin",
        "the spin of a free disc changes in step 1",
    ),
    ({"seen": change_spins(lambda spins, _: -spins)}, "friction[least-sliding]", "ends with a wrong spin"),
    ({"seen": change_spins(lambda *_: None)}, "greatest-spin", "no spins are reported"),
    ({"seen": scale_friction_impulses(2.0)}, "rubbing[tuned]", "do not explain the velocity change"),
    ({"staged": ROUGH}, "rubbing[tuned]", "is too large"),
    # Spins change in impacts that are not head-on, and no contact is reported.
    (
        {"seen": lambda seen, step: seen if step < 60 else replace(seen, contacts=())},
        "rubbing[tuned]",
        "no contact is reported",
    ),
]


@each("changes, case, words", LIES_ABOUT_SPIN)
def test_false_statement_about_spin_fails_its_case(
    changes: dict[str, Any], case: str, words: str, run_case: Held
) -> None:
    """Pymunk passes each case about spin and friction; an adapter with a false statement fails it, with its message."""
    assert run_case(HONEST, case) == ""
    assert words in run_case(Lying(**changes), case)


@each(
    "field, value, refused",
    [
        ("spin", False, ["spin"]),
        ("friction", (0.0, 0.0), ["friction"]),
        ("friction", (0.01, 5.0), ["friction-below-the-range", "friction-above-the-range"]),
        ("max_spin_rad_s", 10, ["fast-spin"]),
        ("min_inertia_factor", 0.1, ["small-inertia"]),
        ("tangential_restitution", False, ["tangential-restitution"]),
        ("max_turn_rad", 1, ["turn"]),
    ],
)
def test_scene_beyond_the_declared_spin_must_be_refused(
    field: str, value: Any, refused: list[str], run_case: Held
) -> None:
    """An adapter fails if it runs a scene with spin or friction beyond what it declares, and omits what it can't do."""
    omitted = restage(lambda _: {"tangential_restitution": 0.0, "wall_tangential_restitution": 0.0})
    lying = Lying(staged=omitted, declared={field: value})
    for case in refused:
        assert f"because the adapter declares {field} = {value}" in run_case(lying, f"refuses[{case}]")
