"""The campaign of features: dozens of its scenes show no new difference, and each planted fault is noticed."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests.campaign import feature_checks, features
from tests.campaign.campaign import Checked, Finding
from tests.campaign.comparison import Kind
from tests.campaign.envelope import EnvelopeMode, compute_envelope
from tests.campaign.feature_checks import Check, check_scene
from tests.campaign.feature_scenes import Law, draw_scene, law_of
from tests.campaign.transformation import rotate_scene
from tests.cases import each, long_until, release_after
from tests.scene_builders import alter_impact, disc_at, require_value, staged, wall_at

from carom import Chain, Disc, Mode, Outcome, Ring, Scene, Trace, Wall, load_scene, solve_pic
from carom.solvers.pic import start_pic_run
from carom.solvers.run import Run

Doctor = Callable[[Trace], Trace]

#: Laws and number of scenes: first a quick selection, then all.
LAWS: list[tuple[set[Law], int]] = [({Law.STRAIGHT, Law.DAMPED}, 30), (set(Law), 60)]

#: Scenes whose events are all proven, so that nothing hides a fault: rough discs among driven walls, and contact.
DRIVEN_BOX = staged(
    "driven box",
    disc_at(-1.0, 0.25, 2.0, 0.5, spin_rad_s=3.0),
    disc_at(1.0, -0.125, -1.0, 0.25, r=0.25, m=1e-3),
    wall_at(-3.0, 0.0, 1.0, 0.0, velocity_m_s=(0.25, 0.0)),
    wall_at(3.0, 0.0, -1.0, 0.0, surface_speed_m_s=0.5),
    *(Ring(centre_m=(0.0, y), radius_m=1.0) for y in (2.5, -2.5)),
    restitution=0.8,
    friction=0.3,
    wall_friction=0.2,
    duration_s=3.0,
)
DOWN = {"gravity_m_s2": (0.0, -10.0)}
_WALLS = wall_at(0.0, 0.0, 0.0, 1.0), wall_at(9.0, 0.0, -1.0, 0.0)
SLIDE = staged("slide", disc_at(0.0, 0.5, 2.0), *_WALLS, wall_friction=0.25, duration_s=2.0, **DOWN)
REVERSAL = SLIDE.model_copy(update={"gravity_m_s2": (-4.0, -10.0)})
#: A disc that comes to rest in a circle, where it bounces until hops are lower than the resolution of the gap.
_RING = Ring(centre_m=(0.0, 0.0), radius_m=2.0)
BOWL = staged("bowl", disc_at(0.5, 0.0, 0.5, r=0.25), _RING, wall_restitution=0.25, duration_s=5.0, **DOWN)


@each("laws, count", release_after(1, LAWS))
def test_campaign_scenes_have_no_findings(laws: set[Law], count: int) -> None:
    """Dozens of campaign scenes match certified runs, and are equal when rotated, in pieces, or by all pairs."""
    scenes = [scene for scene in map(draw_scene, range(count)) if law_of(scene) in laws]
    checked = {scene.name: check_scene(scene) for scene in scenes}
    assert {name: found.findings for name, found in checked.items() if found.findings} == {}
    impacts, certified = (sum(found.sums[name] for found in checked.values()) for name in ("impacts", "certified"))
    assert certified > impacts / 2 > len(scenes)


@pytest.mark.long
def test_campaign_scenes_have_every_feature() -> None:
    """Each law, and each kind of wall and disc, occurs in sixty scenes, and a number always gives the same scene."""
    scenes = [draw_scene(number) for number in range(60)]
    assert {law_of(scene) for scene in scenes} == set(Law)
    bodies = [body for scene in scenes for body in (*scene.discs, *scene.walls)]
    fields = {name for body in (*scenes, *bodies) for name, value in body if value and name != "normal"}
    wanted = (
        "bulges closed driven friction half_width_m legs restitution solid spin_rad_s surface_speed_m_s velocity_m_s"
    )
    assert {*wanted.split(), "wall_rolling_resistance"} <= fields
    assert {type(body) for body in bodies} == {Chain, Disc, Ring, Wall}
    assert {0.0, 1.0} < {scene.restitution for scene in scenes}
    assert any(body.immovable and not body.driven for body in bodies if isinstance(body, Disc))
    assert any(not scene.walls for scene in scenes)
    assert draw_scene(7) == scenes[7]


# Planted faults -------------------------------------------------------------------------------------------------------


def keep_rows(trace: Trace, rows: Any) -> Trace:
    """Return the trace with some of its impacts; a row may occur twice."""
    spins, edges = (None if of_impacts is None else of_impacts[rows] for of_impacts in (trace.spins, trace.edges))
    return replace(trace, impacts=trace.impacts[rows], spins=spins, edges=edges)


def remove_impact(trace: Trace, k: int = 1) -> Trace:
    return keep_rows(trace, [row for row in range(len(trace.impacts)) if row != k])


def add_impact(trace: Trace) -> Trace:
    """Return the trace with the second impact twice, the later one between this and the next."""
    between_s = 0.5 * (trace.impacts["time_s"][1] + trace.impacts["time_s"][2])
    return alter_impact(keep_rows(trace, [0, 1, *range(1, len(trace.impacts))]), 2, time_s=between_s)


def change_field(name: str, part: float) -> Doctor:
    """Return a function that changes one number of the third impact by a fraction."""
    return lambda trace: alter_impact(trace, 2, **{name: trace.impacts[name][2] * (1.0 + part)})


def change_row(rows: str, row: int, name: str, change: Callable[[Any], Any]) -> Doctor:
    """Return a function that changes one field of a row of the trace's modes or spins."""

    def doctor(trace: Trace) -> Trace:
        found = require_value(getattr(trace, rows)).copy()
        found[name][row] = change(found[name][row])
        return replace(trace, **{rows: found})

    return doctor


def end_early(trace: Trace) -> Trace:
    """Return the trace as if its run had ended by name after two impacts."""
    end_s = float(trace.impacts["time_s"][1])
    return replace(keep_rows(trace, slice(2)), end_time_s=end_s, outcome=Outcome.STANDSTILL)


def end_late(trace: Trace) -> Trace:
    """Return the trace as if its run had ended by name after all impacts, before the end of the scene."""
    return replace(trace, end_time_s=0.5 * (trace.end_time_s + trace.impacts["time_s"][-1]), outcome=Outcome.GLIDES)


FAULTS: list[tuple[Doctor, Kind]] = [
    (remove_impact, Kind.MISSED),
    (add_impact, Kind.SPURIOUS),
    (change_field("time_s", 1e-13), Kind.TIME),
    (change_field("velocity_first_after", 1e-13), Kind.VELOCITY),
    (change_field("velocity_first_before", 1e-13), Kind.VELOCITY),
    (change_row("spins", 1, "first_after", lambda spin: spin + 1e-11), Kind.SPIN),
    (lambda trace: replace(trace, final_position_m=trace.final_position_m + 1e-12), Kind.FINAL_STATE),
    (end_early, Kind.EARLY_END),
    (end_late, Kind.ENDING),
]


def find_certified_kinds(checked: Checked) -> set[str]:
    """Return the kinds of the differences from a certified run."""
    found = [finding.kind.partition(": ") for finding in checked.findings]
    return {kind for check, _, kind in found if check == Check.CERTIFIED}


def solve_with(doctor: Doctor) -> Callable[..., Trace]:
    return lambda scene, **options: doctor(solve_pic(scene, **options))


def test_scenes_for_planted_faults_have_no_findings() -> None:
    """Without a fault all scenes have several certified events and no finding."""
    for scene in (DRIVEN_BOX, SLIDE, REVERSAL):
        checked = check_scene(scene)
        assert checked.findings == []
        assert checked.sums["certified"] + checked.sums["changes of modes"] > 1
    assert check_scene(DRIVEN_BOX).sums["order proven"] > 3


@each("doctor, kind", FAULTS)
def test_planted_fault_is_found(doctor: Doctor, kind: Kind) -> None:
    """A missing or extra impact, a number off by hundreds of roundings, or an unexplained end is a finding."""
    checked = check_scene(DRIVEN_BOX, solve_with(doctor))
    assert kind.value in find_certified_kinds(checked)


@each("doctor, kind", [(remove_impact, Kind.MISSED), (change_field("time_s", 1e-9), Kind.TIME)])
def test_fault_beyond_the_envelope_is_found(doctor: Doctor, kind: Kind, monkeypatch: pytest.MonkeyPatch) -> None:
    """Where the rounding envelope decides nothing, certified run and copies of the scene find the fault."""
    monkeypatch.setattr(feature_checks, "MOST_EVENTS", 0)
    assert check_scene(DRIVEN_BOX).findings == []
    assert kind.value in find_certified_kinds(check_scene(DRIVEN_BOX, solve_with(doctor)))


def test_fault_of_a_contact_mode_is_found() -> None:
    """A mode change is a finding if it is missing, is off by hundreds of roundings, or calls a rolling disc at rest."""
    assert any(isinstance(event, EnvelopeMode) for event in compute_envelope(SLIDE, solve_pic(SLIDE), 9).events)
    assert require_value(solve_pic(SLIDE).modes)["after"][-1] == Mode.ROLL
    faults: tuple[tuple[Scene, Doctor], ...] = (
        (SLIDE, lambda trace: replace(trace, modes=require_value(trace.modes)[:-1])),
        (SLIDE, change_row("modes", -1, "time_s", lambda time_s: time_s * (1.0 + 1e-13))),
        (SLIDE, change_row("modes", -1, "after", lambda _: Mode.REST)),
        (REVERSAL, change_row("modes", 1, "time_s", lambda time_s: time_s + 0.125)),
    )
    for scene, doctor in faults:
        assert find_certified_kinds(check_scene(scene, solve_with(doctor))) == {Kind.MODE.value}


@pytest.mark.long
def test_contact_may_replace_hops_below_the_gap_resolution() -> None:
    """Certified bounces after PIC's contact are no finding if they are lower than the resolution of the gap."""
    checked = check_scene(BOWL)
    assert checked.findings == []
    assert checked.sums["contact from low hops"]

    def sooner(trace: Trace) -> Trace:
        if trace.outcome is not Outcome.AT_REST:
            return trace
        return replace(keep_rows(trace, slice(-2)), end_time_s=float(trace.impacts["time_s"][-3]))

    found = check_scene(BOWL, solve_with(sooner))
    assert Kind.EARLY_END.value in find_certified_kinds(found)
    assert not found.sums["contact from low hops"]


#: Numbers of random scenes, and why their results differ.
EXPLAINED = {
    221048: "the end of a contact has no upper bound at the first precision",
    43248: "contact begins inside an arc, where hops are lower than the resolution of the gap",
    107541: "a disc lands at rest, and roundings could make it roll",
    228982: "slip and spin end at times that the clock does not distinguish",
    46411: "a change of mode in contact rounds a position by one unit in the last place before an impact",
    61741: "the run ends among the last bounces before a landing",
    221475: "the first hop that is too low to resolve ends before PIC's landing",
    231155: "all copies end where the certified run ends",
}


@each("number", long_until(4, EXPLAINED))
def test_differences_explained_by_rounding_are_no_findings(number: int) -> None:
    """Scenes whose differences rounding explains have no findings."""
    assert check_scene(draw_scene(number)).findings == []


def test_contact_may_continue_where_rounding_decides_a_hop() -> None:
    """Contact that continues where only rounding decides about a hop is counted, and is no finding."""
    # The normal of an immovable disc is along the wall to rounding.
    checked = check_scene(draw_scene(23619))
    assert checked.findings == []
    assert checked.sums["contact kept"]


@pytest.mark.long
def test_missing_hop_that_is_certain_is_found() -> None:
    """Contact that continues where a certain hop is missing is a finding, however low the hop is."""

    def without_hop(trace: Trace) -> Trace:
        modes = np.delete(require_value(trace.modes), 44)
        modes["after"][43] = Mode.SLIDE
        modes["impacts"][44:] -= 1
        return replace(remove_impact(trace, 31), modes=modes)

    corner = draw_scene(23403)
    assert check_scene(corner).findings == []
    found = check_scene(corner, solve_with(without_hop))
    assert Kind.MODE.value in find_certified_kinds(found)
    assert not found.sums["contact kept"]


OTHER_BITS = [("start_pic_run", Check.PIECES), ("all_pairs_run", Check.ALL_PAIRS), ("rotate_scene", Check.ROTATED)]


@each("name, check", OTHER_BITS)
def test_runs_with_other_bits_are_found(name: str, check: Check, monkeypatch: pytest.MonkeyPatch) -> None:
    """A run in pieces, by all pairs or rotated, whose start differs by one bit, is a finding of that check."""
    calls = []

    def shifted(scene: Scene) -> Scene:
        first, *others = scene.discs
        x, y = first.position_m
        moved = first.model_copy(update={"position_m": (np.nextafter(x, 9.0).item(), y)})
        return scene.model_copy(update={"discs": (moved, *others)})

    def run(scene: Scene) -> Run:
        calls.append(name)
        return start_pic_run(shifted(scene) if name != "start_pic_run" or len(calls) == 2 else scene)

    def rotated(scene: Scene, *arguments: Any, **options: Any) -> Scene:
        return rotate_scene(shifted(scene), *arguments, **options)

    monkeypatch.setattr(feature_checks, name, rotated if name == "rotate_scene" else run)
    assert f"{check}: other bits" in {finding.kind for finding in check_scene(DRIVEN_BOX).findings}


def test_exception_and_endless_run_are_findings(monkeypatch: pytest.MonkeyPatch) -> None:
    """An exception of a solver is a finding of its check, and a check beyond its time limit is a finding, too."""

    def fails(_scene: Scene) -> Run:
        raise ZeroDivisionError("planted")

    monkeypatch.setattr(feature_checks, "all_pairs_run", fails)
    found = check_scene(DRIVEN_BOX).findings
    assert found == [Finding(f"{Check.ALL_PAIRS}: ZeroDivisionError", "raised ZeroDivisionError: planted")]

    def runs_on(_scene: Scene) -> Run:
        while True:
            pass

    monkeypatch.setattr(feature_checks, "all_pairs_run", runs_on)
    monkeypatch.setattr(feature_checks, "SCENE_S", 0.2)
    monkeypatch.setattr(feature_checks, "LEAST_S", 0.1)
    (finding,) = check_scene(DRIVEN_BOX).findings
    assert finding.kind == f"{Check.TIME_LIMIT}: no end of {Check.ALL_PAIRS}"


# The command ----------------------------------------------------------------------------------------------------------


def test_finding_is_saved_as_a_scene_with_its_reason(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """The command counts a finding, saves its scene, prints the command to repeat it, and returns 1."""
    finding = Finding(f"{Check.CERTIFIED}: {Kind.MISSED}", "disc 0 and wall 1 meet at 0.5 s")
    monkeypatch.setattr(features, "check_scene", lambda _: Checked(findings=[finding]))
    assert features.CAMPAIGN.main(["--scene", "5", "--out", str(tmp_path)]) == 1
    printed = capsys.readouterr().out
    assert "python -m tests.campaign.features --scene 5" in printed
    assert "| certified run: missed impact | 1 |" in printed
    (path,) = tmp_path.iterdir()
    saved = load_scene(path)
    assert saved.description == "certified run: missed impact: disc 0 and wall 1 meet at 0.5 s"
    assert saved.model_copy(update={"description": ""}) == draw_scene(5)
