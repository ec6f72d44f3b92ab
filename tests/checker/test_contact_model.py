"""The checker knows the TC model: a run that is right by it breaks no rule, and each way to get it wrong breaks one."""

import sys
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from tests.campaign.gas_checks import check_run
from tests.campaign.gases import Gas, Kind
from tests.cases import each
from tests.checker import Report, check, watch
from tests.checker.laws import find_elastic_impacts
from tests.checker.watch import Stretch
from tests.random_scenes import draw_jittered_discs
from tests.unit.solvers.run_kinds import all_pairs

from carom import DiscArrays
from carom.solvers.event_driven.run import EventDrivenRun
from carom.solvers.run import Run

#: Impacts that a faulty run is followed over: past its first new epoch, which comes after 32 a disc.
IMPACTS = 500


@cache
def build_gas() -> Gas:
    """12 rough discs in a box, two of them immovable."""
    start = draw_jittered_discs(np.random.default_rng(5), 12, immovable=2, spread=1.5, restitution=0.98)
    rough = replace(start, wall_restitution=0.95, friction=0.01, wall_friction=0.01)
    return Gas(0, Kind.CONTACT, 0.0, rough, 10_000, 0.1)


def check_gas_run(run: Run, contact_duration_s: float = build_gas().contact_duration_s) -> Report:
    report = Report()
    for stretch in watch(run, build_gas().start, 1e6, IMPACTS):
        check(build_gas().start, stretch, report, contact_duration_s=contact_duration_s)
    return report


def list_rules(report: Report) -> set[str]:
    return {violation.rule for violation in report.violations}


@each("run", [EventDrivenRun, all_pairs])
def test_correct_run_violates_no_rule(run: Callable[..., Run]) -> None:
    """A correct run with the TC model violates no rule; 10 to 90 % of its impacts are elastic."""
    report = check_gas_run(run(build_gas().scene, contact_duration_s=build_gas().contact_duration_s))
    assert (report.violations, report.impacts) == ([], IMPACTS)
    assert 0.1 * IMPACTS < report.elastic < 0.9 * IMPACTS


@each("asked_s", [0.0, 0.1 * (1 - 0.05), 0.1 * (1 + 0.05)])
def test_wrong_contact_duration_violates_the_law(asked_s: float) -> None:
    """A run without the TC model, or checked with a duration that is off by 5 %, violates "law"."""
    assert list_rules(check_gas_run(EventDrivenRun(build_gas().scene, contact_duration_s=asked_s))) == {"law"}
    assert list_rules(
        check_gas_run(EventDrivenRun(build_gas().scene, contact_duration_s=build_gas().contact_duration_s), asked_s)
    ) == {"law"}


def forget_last_impacts(last_s: NDArray[np.float64]) -> None:
    last_s[:] = -np.inf


def shift_last_impacts(last_s: NDArray[np.float64]) -> None:
    last_s[:] = np.roll(last_s, 1)


def advance_last_impacts(last_s: NDArray[np.float64]) -> None:
    last_s += 0.05


#: What becomes of the last impacts of all discs in a saved state.
FAULTS = (forget_last_impacts, shift_last_impacts, advance_last_impacts)


@each("fault", FAULTS)
def test_run_resumed_with_wrong_last_impacts_is_found(
    fault: Callable[[NDArray[np.float64]], None], monkeypatch: pytest.MonkeyPatch
) -> None:
    """A run that is resumed from a state with wrong times of last impacts violates the rule "law"."""
    watching = sys.modules[watch.__module__]
    monkeypatch.setattr(watching, "RENEWED_AFTER", IMPACTS // 10)
    monkeypatch.setattr(watching, "STRETCH_IMPACTS", IMPACTS // 20)
    assert check_run(build_gas(), IMPACTS).violations == []

    class Wrong(EventDrivenRun):
        def __init__(self, *arguments: Any, resume: Any = None, **options: Any) -> None:
            if resume is not None:
                fault(resume.kernel["last_impacts"].view(np.float64))
            super().__init__(*arguments, resume=resume, **options)

    monkeypatch.setattr("tests.campaign.gas_checks.EventDrivenRun", Wrong)
    assert list_rules(check_run(build_gas(), IMPACTS)) == {"law"}


def test_impact_after_exactly_the_contact_duration_may_be_elastic() -> None:
    """An impact after exactly the contact duration may be elastic or not; any other velocity violates the law."""
    walls = ((0.0, 0.0, 1.0, 0.0), (4.0, 0.0, -1.0, 0.0))
    place, velocity, radius = np.array([[1.0, 0.0]]), np.array([[-1.0, 0.0]]), np.array([0.5])
    start = DiscArrays(place, velocity, radius, np.ones(1), walls, wall_restitution=0.5)

    def broken(stretch: Stretch, contact_duration_s: float) -> set[str]:
        report = Report()
        check(start, stretch, report, contact_duration_s=contact_duration_s)
        return list_rules(report)

    (stretch,) = watch(EventDrivenRun(start), start, 100.0, 2)
    first_s, second_s = stretch.impacts["time_s"].tolist()  # at a velocity of .5 after the first
    assert (first_s, second_s) == (0.5, 6.5)
    for contact_duration_s, kinds in ((5.0, [0, 0]), (6.0, [0, 1]), (7.0, [1, 1])):
        elastic = find_elastic_impacts(start, stretch, contact_duration_s)
        assert [int(elastic.surely.sum()), int(elastic.maybe.sum())] == kinds
        assert broken(stretch, contact_duration_s) == ({"law"} if contact_duration_s == 7.0 else set())
    (kept,) = watch(EventDrivenRun(start, contact_duration_s=7.0), start, 100.0, 2)
    assert [broken(kept, contact_duration_s) for contact_duration_s in (5.0, 6.0, 7.0)] == [{"law"}, set(), set()]
    slower = kept.impacts.copy()
    slower["velocity_first_after"][1] *= 0.9
    assert "law" in broken(replace(kept, impacts=slower), 6.0)
