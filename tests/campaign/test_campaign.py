"""The campaigns' commands: they count, go on where they were, and tell what they find and how to see it again."""

from __future__ import annotations

import math
import signal
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests.campaign import __main__ as command
from tests.campaign import run as campaign_run
from tests.campaign import tables
from tests.campaign.gases import Gas, Kind, draw
from tests.campaign.tally import Tally
from tests.checker import RULES, Report, Violation
from tests.lengths import each, release_after
from tests.stage import sure
from tests.validation.table_runs import Comparison

from carom import DiscArrays
from carom.model.trace import Outcome
from carom.solvers.event_driven.run import EventDrivenRun


@pytest.mark.release
def test_counts_add_up_over_calls(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    """A second call goes on with the next gas, and its table holds the impacts of both."""
    state = tmp_path / "campaign.json"
    for impacts, gases in ((1, 1), (1, 1), (20_000, 2)):
        arguments = ["--impacts", str(impacts), "--state", str(state), "--most-discs", "64", "--jobs", "1"]
        assert command.main(arguments) == 0
        tally = Tally.load(state)
        assert tally.begun == gases
        assert f"| {tally.impacts:,} |" in capfd.readouterr().out
    assert [tally.counts[kind].gases for kind in Kind][:3] == [1, 1, 0]


def test_a_broken_rule_is_told_with_the_way_to_see_it_again(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """What is found is printed, counted as what it is, and makes the exit code 1."""
    report = Report(impacts=7, violations=[Violation("contact", 3, (0, 2), 0.8, 7.25, 1e-13)], worst_gap=math.inf)
    monkeypatch.setattr(command, "checked", lambda _: report)
    assert command.main(["--gas", "2", "--most-discs", "64"]) == 1
    assert "contact: the two bodies touch; impact 3, bodies 0, 2, at 0.8 s" in capsys.readouterr().out
    tally = Tally()
    (finding,) = tally.add(draw(2, most_discs=64), report)
    assert "python -m tests.campaign --gas 2" in str(finding)
    assert tally.counts[Kind.IMMOVABLE].phantoms == 1


class Gains(EventDrivenRun):
    """A run whose impacts all give back `FACTOR` times what the law says."""

    FACTOR = 1.0

    def __init__(self, start: DiscArrays, **options: Any) -> None:
        wrong = replace(start)
        object.__setattr__(wrong, "restitution", self.FACTOR)  # beyond what is accepted
        object.__setattr__(wrong, "wall_restitution", self.FACTOR)
        super().__init__(wrong, **options)


@pytest.mark.parametrize(
    ("factor", "rule"),
    release_after(1, [(1e150, "row"), (1.0 + 1e-9, "law"), (1.25, "law"), (2.0, "row"), (100.0, "row")]),
)
def test_a_kernel_that_gains_energy_without_bound_is_found(
    factor: float, rule: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """A kernel whose speeds grow at every impact, to overflow, breaks a rule that is named, and raises nothing."""
    monkeypatch.setattr(Gains, "FACTOR", factor)
    monkeypatch.setattr(campaign_run, "EventDrivenRun", Gains)
    assert command.main(["--gas", "0", "--most-discs", "64"]) == 1
    printed = capsys.readouterr().out
    assert RULES[rule] in printed.split("Rules:")[0]


def test_what_a_broken_kernel_raises_is_found(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """A run that raises halfway breaks the rule "end", and its impacts up to the last look have been checked."""

    class Raises(EventDrivenRun):
        def advance_to(self, *arguments: Any, **options: Any) -> Outcome:
            if self.counts["impacts"] >= 256:
                raise OverflowError("planted")
            return super().advance_to(*arguments, **options)

    monkeypatch.setattr(campaign_run, "EventDrivenRun", Raises)
    report = campaign_run.checked(draw(0, most_discs=64))
    assert report.impacts == 256
    assert [violation.rule for violation in report.violations] == ["end"]
    assert command.main(["--gas", "0", "--most-discs", "64"]) == 1
    assert "raised OverflowError: planted" in capsys.readouterr().out


@pytest.mark.release
@pytest.mark.usefixtures("heard_interrupts")
def test_ctrl_c_shows_what_has_been_done(tmp_path: Path) -> None:
    """Ctrl-C ends with the gas under way: the table and the file hold all that has been checked."""
    state = tmp_path / "campaign.json"
    options = ["--impacts", "1e12", "--most-discs", "64", "--state", str(state)]
    with subprocess.Popen(
        [sys.executable, "-m", "tests.campaign", *options],
        cwd=Path(__file__).parents[2],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    ) as process:
        assert "gas 0: 64 discs" in sure(process.stderr).readline()
        process.send_signal(signal.SIGINT)
        table = sure(process.stdout).read()
        assert process.wait() == command.INTERRUPTED
    assert f"| {Tally.load(state).impacts:,} |" in table


@each("kind", list(Kind))
def test_a_gas_is_drawn_from_its_number_alone(kind: Kind) -> None:
    """The same number gives the same gas, within the sizes and packings that the campaign promises."""
    for number in range(6):
        gas, again = draw(number, kind), draw(number, kind)
        assert gas.start.position_m.tobytes() == again.start.position_m.tobytes()
        assert gas.start.velocity_m_s.tobytes() == again.start.velocity_m_s.tobytes()
        least, most = (4, 64) if kind is Kind.FALLING else (64, 10_000)
        assert least <= len(gas.start) <= most
        assert gas.packing == 0.0 if kind is Kind.OPEN else 0.09 < gas.packing < 0.79
        assert np.isfinite(gas.start.mass_kg).any()


@pytest.mark.release
def test_counts_of_tables_add_up_over_calls(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A second call goes on with the next table, and its counts hold the impacts of both."""
    state = tmp_path / "tables.json"
    for many in (1, 3):
        assert tables.main(["--tables", str(many), "--state", str(state)]) == 0
        tally = tables.Tally.load(state)
        assert tally.tables == many
        assert f"| all | {many} | {tally.impacts:,} |" in capsys.readouterr().out
    assert tables.main(["--tables", "9", "--minutes", "0", "--state", str(state)]) == 0
    assert tables.Tally.load(state) == tally


def test_a_contradiction_of_tables_is_told_with_the_way_to_see_it_again(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """It makes the exit code 1, and the table's number is printed."""
    monkeypatch.setattr(tables, "compare", lambda *_: Comparison(3, "contradiction", 7.0))
    assert tables.main(["--tables", "1"]) == 1
    told = capsys.readouterr()
    assert "python -m tests.campaign.tables --table 0" in told.err
    assert "| all | 1 | 3 | 0 | 0 | 0 | 0 | 1 | 7.00 |" in told.out
    assert tables.main(["--table", "0"]) == 1
    assert "ended='contradiction'" in capsys.readouterr().out


def assert_right(gas: Gas, impacts: int) -> None:
    report = campaign_run.checked(gas, impacts)
    assert [str(violation) for violation in report.violations[:5]] == []
    assert 0 < report.impacts <= impacts


@each("number, impacts", release_after(1, [(0, 400), (0, 12_500), (1, 12_500)]))
@each("kind", list(Kind))
def test_every_impact_of_a_gas_can_have_happened_and_none_is_missed(kind: Kind, number: int, impacts: int) -> None:
    """At each impact each rule of the checker holds: contact, approach, history, law, order, no overlap."""
    assert_right(draw(number, kind, most_discs=1000), impacts)


@pytest.mark.release
@each("number", range(20))
def test_two_million_more_impacts_are_right(number: int) -> None:
    """Over some two million impacts of gases of up to 10,000 discs each rule of the checker holds."""
    assert_right(draw(1000 + number), 100_000)
