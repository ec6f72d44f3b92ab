"""The checker knows the TC model: a run that is right by it breaks no rule, and each way to get it wrong breaks one."""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest
from tests.campaign.gases import Gas, Kind
from tests.campaign.run import checked
from tests.checker import Report, check, watch
from tests.checker.laws import elastic_of
from tests.drawn import jittered
from tests.lengths import long_after

from carom import DiscArrays
from carom.solvers.event_driven.run import EventDrivenRun
from carom.solvers.plain.instants import Instant
from carom.solvers.plain.run import AllPairsRun
from carom.solvers.run import Run

#: Impacts that a faulty run is followed over: past its first new epoch, which comes after 32 a disc.
IMPACTS = 500


@cache
def gas() -> Gas:
    """12 rough discs in a box, two of them immovable."""
    start = jittered(np.random.default_rng(5), 12, immovable=2, spread=1.5, restitution=0.98)
    rough = replace(start, wall_restitution=0.95, friction=0.01, wall_friction=0.01)
    return Gas(0, Kind.CONTACT, 0.0, rough, 10_000, 0.1)


def seen(run: Run, contact_duration_s: float = gas().contact_duration_s) -> Report:
    report = Report()
    for stretch in watch(run, gas().start, 1e6, IMPACTS):
        check(gas().start, stretch, report, contact_duration_s=contact_duration_s)
    return report


def rules(report: Report) -> set[str]:
    return {violation.rule for violation in report.violations}


@pytest.mark.parametrize("run", [EventDrivenRun, AllPairsRun])
def test_a_right_run_breaks_no_rule(run: Callable[..., Run]) -> None:
    """What is done wrong below is right before, and many impacts, on walls too, are elastic and many are not."""
    report = seen(run(gas(), contact_duration_s=gas().contact_duration_s))
    assert report.violations == []
    assert report.impacts == IMPACTS
    assert 0.1 * IMPACTS < report.elastic < 0.9 * IMPACTS


@pytest.mark.parametrize("asked_s", [0.0, 0.1 * (1 - 0.05), 0.1 * (1 + 0.05)])
def test_another_contact_time_breaks_the_law(asked_s: float) -> None:
    """A run that leaves the TC model out, or has its time a twentieth off, is found, and so is the reverse."""
    assert rules(seen(EventDrivenRun(gas(), contact_duration_s=asked_s))) == {"law"}
    assert rules(seen(EventDrivenRun(gas(), contact_duration_s=gas().contact_duration_s), asked_s)) == {"law"}


class Wrong(AllPairsRun):
    """A run by the TC model that forgets, or misplaces, when its discs had their last impacts."""

    fault = ""

    def _carry_out(self, first: int, second: int, instant: Instant) -> None:
        last_s, wall = self._last_impact_s, second < 0
        if self.fault == "second disc not looked at" and not wall:
            last_s[second] = -np.inf
        if self.fault == "first disc not looked at" or (self.fault == "walls not elastic" and wall):
            last_s[first] = -np.inf
        before_s = last_s[first]
        super()._carry_out(first, second, instant)
        if self.fault == "impacts on walls not kept" and wall:
            last_s[first] = before_s
        if self.fault == "kept of another disc" and not wall:
            last_s[second - 1], last_s[second] = last_s[second], before_s

    def _begin_epoch(self) -> None:
        last_s = self._last_impact_s
        super()._begin_epoch()
        if self.fault == "not taken to the new epoch":
            self._last_impact_s = last_s


@pytest.mark.parametrize(
    "fault",
    long_after(
        3,
        [
            *("kept of another disc", "not taken to the new epoch", "first disc not looked at"),
            *("second disc not looked at", "walls not elastic", "impacts on walls not kept"),
        ],
    ),
)
def test_the_law_of_the_wrong_disc_or_time_is_found(fault: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """A last impact that is forgotten, or kept of another disc, makes an impact elastic, or inelastic, that is not."""
    monkeypatch.setattr(Wrong, "fault", fault)
    assert rules(seen(Wrong(gas(), contact_duration_s=gas().contact_duration_s))) == {"law"}


def test_an_elastic_impact_that_rubs_is_found() -> None:
    """One contact has neither dissipation nor friction: a run that takes but the first from it is found."""
    run = AllPairsRun(gas(), contact_duration_s=gas().contact_duration_s)
    bodies, collide = run.bodies, run.bodies.collide

    def rubs(*arguments: Any, elastic: bool = False) -> Any:
        law = bodies.restitution, bodies.wall_restitution
        if elastic:
            bodies.restitution = bodies.wall_restitution = 1.0
        record = collide(*arguments)
        bodies.restitution, bodies.wall_restitution = law
        return record

    bodies.collide = rubs  # type: ignore[assignment, method-assign]  # a planted fault
    assert rules(seen(run)) == {"law"}


def test_a_run_that_is_taken_up_without_its_last_impacts_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    """The campaign takes its runs up from saved states; where these lack the last impacts, a law is broken."""
    watching = sys.modules[watch.__module__]
    monkeypatch.setattr(watching, "RENEWED_AFTER", IMPACTS // 2)
    monkeypatch.setattr(watching, "STRETCH_IMPACTS", IMPACTS // 4)
    assert checked(gas(), IMPACTS).violations == []

    class Forgets(EventDrivenRun):
        def __init__(self, *arguments: Any, resume: Any = None, **options: Any) -> None:
            if resume is not None:
                resume.kernel["last_impacts"].view(np.float64)[:] = -np.inf
            super().__init__(*arguments, resume=resume, **options)

    monkeypatch.setattr("tests.campaign.run.EventDrivenRun", Forgets)
    assert rules(checked(gas(), IMPACTS)) == {"law"}


def test_where_rounding_leaves_the_law_open_either_holds() -> None:
    """An impact that comes after exactly the contact time, as recorded, may be elastic or not, and nothing else."""
    walls = ((0.0, 0.0, 1.0, 0.0), (4.0, 0.0, -1.0, 0.0))
    start = DiscArrays(
        np.array([[1.0, 0.0]]), np.array([[-1.0, 0.0]]), np.array([0.5]), np.ones(1), walls, wall_restitution=0.5
    )
    (stretch,) = watch(EventDrivenRun(start), start, 100.0, 2)
    first_s, second_s = stretch.impacts["time_s"].tolist()  # at a velocity of .5 after the first
    assert (first_s, second_s) == (0.5, 6.5)
    for contact_duration_s, kinds in ((5.0, [0, 0]), (6.0, [0, 1]), (7.0, [1, 1])):
        elastic = elastic_of(start, stretch, contact_duration_s)
        assert [int(elastic.surely.sum()), int(elastic.maybe.sum())] == kinds
        report = Report()
        check(start, stretch, report, contact_duration_s=contact_duration_s)
        assert rules(report) == ({"law"} if contact_duration_s == 7.0 else set())
    (kept,) = watch(EventDrivenRun(start, contact_duration_s=7.0), start, 100.0, 2)
    for contact_duration_s, broken in ((5.0, {"law"}), (6.0, set()), (7.0, set())):
        report = Report()
        check(start, kept, report, contact_duration_s=contact_duration_s)
        assert rules(report) == broken
    slower = kept.impacts.copy()
    slower["velocity_first_after"][1] *= 0.9
    report = Report()
    check(start, replace(kept, impacts=slower), report, contact_duration_s=6.0)
    assert "law" in rules(report)
