"""The campaign of features: dozens of its scenes show no new difference, and each planted fault is noticed."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests.campaign import feature_checks, features
from tests.campaign.comparison import Kind, Record
from tests.campaign.envelope import EnvelopeMode, compute_envelope
from tests.campaign.feature_checks import Check, CheckedScene, Finding, check_scene
from tests.campaign.feature_scenes import Law, draw_scene, features_of, law_of
from tests.campaign.transformation import restore_record, rotate_scene
from tests.cases import each, release_after
from tests.scene_builders import require_value
from tests.transformed_scenes import turn_by

from carom import Disc, Mode, Outcome, Ring, Scene, Trace, Wall, load_scene, solve_pic
from carom.solvers.pic import start_pic_run
from carom.solvers.run import Run

Doctor = Callable[[Trace], Trace]

#: Laws of scenes of which every check is run: those that compiled code runs, then all.
LAWS = {"compiled": {Law.STRAIGHT, Law.DAMPED}, "all": set(Law)}
#: Numbers of these scenes, below a limit, that show no difference.
NUMBERS = 60

#: Scenes whose events are all proven, so that nothing hides a fault: rough discs among driven walls, and contact.
DRIVEN_BOX = Scene(
    name="driven box",
    discs=[
        Disc(position_m=(-1.0, 0.25), velocity_m_s=(2.0, 0.5), radius_m=0.5, spin_rad_s=3.0),
        Disc(position_m=(1.0, -0.125), velocity_m_s=(-1.0, 0.25), radius_m=0.25, mass_kg=1e-3),
    ],
    walls=[
        Wall(point_m=(-3.0, 0.0), normal=(1.0, 0.0), velocity_m_s=(0.25, 0.0)),
        Wall(point_m=(3.0, 0.0), normal=(-1.0, 0.0), surface_speed_m_s=0.5),
        Ring(centre_m=(0.0, 2.5), radius_m=1.0),
        Ring(centre_m=(0.0, -2.5), radius_m=1.0),
    ],
    restitution=0.8,
    friction=0.3,
    wall_friction=0.2,
    duration_s=3.0,
)
SLIDE = Scene(
    name="slide",
    discs=[Disc(position_m=(0.0, 0.5), velocity_m_s=(2.0, 0.0), radius_m=0.5)],
    walls=[Wall(point_m=(0.0, 0.0), normal=(0.0, 1.0)), Wall(point_m=(9.0, 0.0), normal=(-1.0, 0.0))],
    wall_friction=0.25,
    gravity_m_s2=(0.0, -10.0),
    duration_s=2.0,
)
#: A disc that comes to rest in a circle, where it bounces until hops are lower than the resolution of the gap.
BOWL = Scene(
    name="bowl",
    discs=[Disc(position_m=(0.5, 0.0), velocity_m_s=(0.5, 0.0), radius_m=0.25)],
    walls=[Ring(centre_m=(0.0, 0.0), radius_m=2.0)],
    wall_restitution=0.25,
    gravity_m_s2=(0.0, -10.0),
    duration_s=5.0,
)


@each("laws", release_after(1, LAWS))
def test_campaign_scenes_have_no_findings(laws: str) -> None:
    r"""Dozens of campaign scenes match certified runs, and are equal when rotated, in pieces, or by all pairs.

    More than half of the impacts are certified.
    """
    scenes = [scene for scene in map(draw_scene, range(NUMBERS)) if law_of(scene) in LAWS[laws]]
    checked = {scene.name: check_scene(scene) for scene in scenes}
    assert {name: found.findings for name, found in checked.items() if found.findings} == {}
    impacts, certified = (sum(getattr(found, name) for found in checked.values()) for name in ("impacts", "certified"))
    assert certified > impacts / 2 > len(scenes)


def test_campaign_scenes_have_every_feature() -> None:
    """Each law, and each of 15 features, occurs in sixty scenes, and a number always gives the same scene."""
    scenes = [draw_scene(number) for number in range(60)]
    assert {law_of(scene) for scene in scenes} == set(Law)
    named = [name for scene in scenes for name in features_of(scene)]
    assert all(named.count(name) > 1 for name in set(named))
    assert len(set(named)) == 15
    assert draw_scene(7) == scenes[7]


# Planted faults -------------------------------------------------------------------------------------------------------


def remove_impact(trace: Trace) -> Trace:
    spins = None if trace.spins is None else np.delete(trace.spins, 1)
    edges = None if trace.edges is None else np.delete(trace.edges, 1)
    return replace(trace, impacts=np.delete(trace.impacts, 1), spins=spins, edges=edges)


def add_impact(trace: Trace) -> Trace:
    """Return the trace with the second impact twice, the later one between this and the next."""
    rows = np.insert(trace.impacts, 2, trace.impacts[1])
    rows["time_s"][2] = 0.5 * (trace.impacts["time_s"][1] + trace.impacts["time_s"][2])
    spins = None if trace.spins is None else np.insert(trace.spins, 2, trace.spins[1])
    edges = None if trace.edges is None else np.insert(trace.edges, 2, trace.edges[1])
    return replace(trace, impacts=rows, spins=spins, edges=edges)


def change_field(name: str, part: float) -> Doctor:
    """Return what changes one number of the third impact by a part of itself."""

    def doctor(trace: Trace) -> Trace:
        rows = trace.impacts.copy()
        rows[name][2] *= 1.0 + part
        return replace(trace, impacts=rows)

    return doctor


def change_spin(trace: Trace) -> Trace:
    spins = require_value(trace.spins).copy()
    spins["first_after"][1] += 1e-11
    return replace(trace, spins=spins)


def change_end(trace: Trace) -> Trace:
    return replace(trace, final_position_m=trace.final_position_m + 1e-12)


def end_early(trace: Trace) -> Trace:
    """Return the trace as if its run had ended by name after two impacts."""
    end_s = float(trace.impacts["time_s"][1])
    spins, edges = require_value(trace.spins)[:2], require_value(trace.edges)[:2]
    return replace(
        trace, impacts=trace.impacts[:2], spins=spins, edges=edges, end_time_s=end_s, outcome=Outcome.STANDSTILL
    )


def end_late(trace: Trace) -> Trace:
    """Return the trace as if its run had ended by name after all impacts, before the end of the scene."""
    return replace(trace, end_time_s=0.5 * (trace.end_time_s + trace.impacts["time_s"][-1]), outcome=Outcome.GLIDES)


FAULTS: list[tuple[Doctor, Kind]] = [
    (remove_impact, Kind.MISSED),
    (add_impact, Kind.SPURIOUS),
    (change_field("time_s", 1e-13), Kind.TIME),
    (change_field("velocity_first_after", 1e-13), Kind.VELOCITY),
    (change_field("velocity_first_before", 1e-13), Kind.VELOCITY),
    (change_spin, Kind.SPIN),
    (change_end, Kind.FINAL_STATE),
    (end_early, Kind.EARLY_END),
    (end_late, Kind.ENDING),
]


def list_kinds(checked: CheckedScene, check: Check) -> set[str]:
    return {finding.kind for finding in checked.findings if finding.check is check}


def solve_with(doctor: Doctor) -> Callable[..., Trace]:
    return lambda scene, **options: doctor(solve_pic(scene, **options))


def test_scenes_for_planted_faults_have_no_findings() -> None:
    """Without a fault both scenes have several certified events and no finding."""
    for scene in (DRIVEN_BOX, SLIDE):
        checked = check_scene(scene)
        assert checked.findings == []
        assert checked.certified + checked.modes > 1
    assert check_scene(DRIVEN_BOX).proven > 3


@each("doctor, kind", FAULTS)
def test_planted_fault_is_found(doctor: Doctor, kind: Kind) -> None:
    """A missing or extra impact, a number off by hundreds of roundings, or an unexplained end is a finding."""
    checked = check_scene(DRIVEN_BOX, solve_with(doctor))
    assert kind.value in list_kinds(checked, Check.CERTIFIED)


@each("doctor, kind", [(remove_impact, Kind.MISSED), (change_field("time_s", 1e-9), Kind.TIME)])
def test_fault_beyond_the_envelope_is_found(doctor: Doctor, kind: Kind, monkeypatch: pytest.MonkeyPatch) -> None:
    """Where the rounding envelope decides nothing, certified run and copies of the scene find the fault."""
    monkeypatch.setattr(feature_checks, "MOST_EVENTS", 0)
    assert check_scene(DRIVEN_BOX).findings == []
    assert kind.value in list_kinds(check_scene(DRIVEN_BOX, solve_with(doctor)), Check.CERTIFIED)


def test_fault_of_a_contact_mode_is_found() -> None:
    """A mode change is a finding if it is missing, is off by hundreds of roundings, or calls a rolling disc at rest."""
    assert any(isinstance(event, EnvelopeMode) for event in compute_envelope(SLIDE, solve_pic(SLIDE), 9).events)

    def without_mode(trace: Trace) -> Trace:
        return replace(trace, modes=require_value(trace.modes)[:-1])

    def late(trace: Trace) -> Trace:
        modes = require_value(trace.modes).copy()
        modes["time_s"][-1] *= 1.0 + 1e-13
        return replace(trace, modes=modes)

    def at_rest(trace: Trace) -> Trace:
        modes = require_value(trace.modes).copy()
        assert modes["after"][-1] == Mode.ROLL
        modes["after"][-1] = Mode.REST
        return replace(trace, modes=modes)

    for doctor in (without_mode, late, at_rest):
        assert list_kinds(check_scene(SLIDE, solve_with(doctor)), Check.CERTIFIED) == {Kind.MODE.value}


def test_contact_may_replace_hops_below_the_gap_resolution() -> None:
    r"""Certified bounces after PIC's contact are no finding if they are lower than the resolution of the gap.

    Higher bounces are one.
    """
    checked = check_scene(BOWL)
    assert checked.findings == []
    assert checked.low_hops

    def sooner(trace: Trace) -> Trace:
        if trace.outcome is not Outcome.AT_REST:
            return trace
        end_s = float(trace.impacts["time_s"][-3])
        return replace(trace, impacts=trace.impacts[:-2], edges=require_value(trace.edges)[:-2], end_time_s=end_s)

    found = check_scene(BOWL, solve_with(sooner))
    assert Kind.EARLY_END.value in list_kinds(found, Check.CERTIFIED)
    assert not found.low_hops


@each("number", [26802, 31459, 41057, 43248, 46411, 47302, 57329, 61741, 107541])
def test_differences_explained_by_rounding_are_no_findings(number: int) -> None:
    r"""Nine scenes whose differences rounding explains have no findings.

    They have a collapse that may begin after certified events, friction whose result is a float, or a start almost
    at rest. In scene 46411 a change of mode in contact rounds a position by one unit in the last place before an
    impact. In scene 61741 the run ends among the last bounces before a landing.
    In scene 107541 a disc lands at rest, and roundings could make it roll.
    """
    assert check_scene(draw_scene(number)).findings == []


@each("number", [104896, 131771])
def test_low_hops_at_the_inside_of_an_arc_are_those_of_the_certified_run(number: int) -> None:
    """A disc that bounces between its ground and the inside of an arc makes every hop of the certified run."""
    assert check_scene(draw_scene(number)).findings == []


def test_contact_may_continue_where_rounding_decides_a_hop() -> None:
    r"""Contact that continues where only rounding decides about a hop is counted, and is no finding.

    A missing hop that is certain is a finding, however low it is. In the first scene the normal of an immovable
    disc is along the wall to rounding.
    """
    checked = check_scene(draw_scene(23619))
    assert checked.findings == []
    assert checked.kept_contact

    def without_hop(trace: Trace) -> Trace:
        modes = np.delete(require_value(trace.modes), 44)
        modes["after"][43] = Mode.SLIDE
        modes["impacts"][44:] -= 1
        spins, edges = np.delete(require_value(trace.spins), 31), np.delete(require_value(trace.edges), 31)
        return replace(trace, modes=modes, impacts=np.delete(trace.impacts, 31), spins=spins, edges=edges)

    corner = draw_scene(23403)
    assert check_scene(corner).findings == []
    found = check_scene(corner, solve_with(without_hop))
    assert Kind.MODE.value in list_kinds(found, Check.CERTIFIED)
    assert not found.kept_contact


def test_end_of_a_slip_that_is_rounding_is_no_finding() -> None:
    """A slip that exists only by rounding may end at any time; a wrong end of another slip is a finding."""
    scene = Scene(
        name="across the slope",
        discs=[Disc(position_m=(2.01744849513864, 2.4495002648363497), radius_m=0.09769212210352762)],
        walls=[Wall(point_m=(-1.4810976512154, -2.608898186507903), normal=(0.4936992170718, 0.8696327288359676))],
        wall_restitution=0.0,
        gravity_m_s2=(-0.1314417357473424, -0.23152970753906155),
        duration_s=28.0,
    )
    assert check_scene(scene).findings == []

    def turned_later(trace: Trace) -> Trace:
        modes = require_value(trace.modes).copy()
        modes["time_s"][1] += 0.125
        return replace(trace, modes=modes)

    slope = SLIDE.model_copy(update={"gravity_m_s2": (-4.0, -10.0)})
    assert check_scene(slope).findings == []
    assert Kind.MODE.value in list_kinds(check_scene(slope, solve_with(turned_later)), Check.CERTIFIED)


def test_impact_that_is_rounding_has_its_own_kind() -> None:
    """An extra impact at a rounding's speed is reported as rounding, and not as spurious."""
    scene = Scene(
        name="stays",
        discs=[Disc(position_m=(0.0, 0.0), velocity_m_s=(-1.0, 0.25), radius_m=0.5)],
        walls=[Wall(point_m=(-2.0, 0.0), normal=(1.0, 0.0), velocity_m_s=(0.125, 0.0))],
        wall_restitution=0.0,
        duration_s=4.0,
    )

    def again(trace: Trace) -> Trace:
        rows = np.repeat(trace.impacts, 2)
        rows["time_s"][1] += 1.0
        rows["velocity_first_before"][1] = (0.125 * (1.0 - 2.0**-53), 0.25)
        return replace(trace, impacts=rows)

    assert check_scene(scene).findings == []
    assert list_kinds(check_scene(scene, solve_with(again)), Check.CERTIFIED) == {Kind.ROUNDING.value}


@each(
    "name, check",
    [("start_pic_run", Check.PIECES), ("all_pairs_run", Check.ALL_PAIRS), ("rotate_scene", Check.ROTATED)],
)
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
    assert check in {finding.check for finding in check_scene(DRIVEN_BOX).findings}


def test_exception_and_endless_run_are_findings(monkeypatch: pytest.MonkeyPatch) -> None:
    """An exception of a solver is a finding of its check, and a check beyond its time limit is a finding, too."""

    def fails(_scene: Scene) -> Run:
        raise ZeroDivisionError("planted")

    monkeypatch.setattr(feature_checks, "all_pairs_run", fails)
    found = check_scene(DRIVEN_BOX).findings
    assert found == [Finding(Check.ALL_PAIRS, "ZeroDivisionError", "raised ZeroDivisionError: planted")]

    def runs_on(_scene: Scene) -> Run:
        while True:
            pass

    monkeypatch.setattr(feature_checks, "all_pairs_run", runs_on)
    monkeypatch.setattr(feature_checks, "SCENE_S", 0.2)
    monkeypatch.setattr(feature_checks, "LEAST_S", 0.1)
    (finding,) = check_scene(DRIVEN_BOX).findings
    assert (finding.check, finding.kind) == (Check.TIME_LIMIT, f"no end of {Check.ALL_PAIRS.value}")


def test_record_of_a_rotated_scene_is_restored() -> None:
    """The record of a scene rotated by 0.7 radians, with its discs in reverse order, is restored to rounding."""
    trace = solve_pic(DRIVEN_BOX)
    record = Record.of(trace)
    turned = rotate_scene(DRIVEN_BOX, turn_by(0.7), is_reversed=True)
    found = restore_record(Record.of(solve_pic(turned)), turn_by(-0.7), is_reversed=True)
    assert feature_checks.unlike_fields(found, found) == []
    assert found.impacts[["first", "second"]].tolist() == record.impacts[["first", "second"]].tolist()
    for name in ("time_s", "normal", "velocity_first_after", "velocity_second_before"):
        np.testing.assert_allclose(found.impacts[name], record.impacts[name], atol=1e-12)
    np.testing.assert_allclose(
        require_value(found.spins)["first_after"], require_value(record.spins)["first_after"], atol=1e-12
    )
    np.testing.assert_allclose(found.final_position_m, record.final_position_m, atol=1e-12)


# The command ----------------------------------------------------------------------------------------------------------


def test_finding_is_saved_as_a_scene_with_its_reason(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """The command counts a finding, saves its scene, prints the command to repeat it, and returns 1."""
    finding = Finding(Check.CERTIFIED, Kind.MISSED.value, "disc 0 and wall 1 meet at 0.5 s")
    monkeypatch.setattr(features, "check_scene", lambda _: CheckedScene(impacts=3, findings=[finding]))
    assert features.CAMPAIGN.main(["--scene", "5", "--out", str(tmp_path)]) == 1
    printed = capsys.readouterr().out
    assert "python -m tests.campaign.features --scene 5" in printed
    assert "| certified run: missed impact | 1 |" in printed
    (path,) = tmp_path.iterdir()
    saved = load_scene(path)
    assert saved.description == "certified run: missed impact: disc 0 and wall 1 meet at 0.5 s"
    assert saved.model_copy(update={"description": ""}) == draw_scene(5)
