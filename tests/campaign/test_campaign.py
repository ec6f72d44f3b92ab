"""The campaigns' commands: counts, continued runs, findings, and the commands that repeat cases."""

import os
import signal
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from tests.campaign import campaign, gas_checks
from tests.campaign.campaign import Campaign, Checked, Finding, Tally
from tests.campaign.gases import Kind, draw_gas
from tests.cases import each, release_after
from tests.scene_builders import require_value

from carom import DiscArrays
from carom.solvers.event_driven.run import EventDrivenRun


def check_number(number: int) -> Checked:
    """Find something in case 3, hang in case 5, end the process in case 6, and raise an exception in case 7."""
    if number == 5:
        time.sleep(3600.0)
    if number == 6:
        os._exit(1)
    if number == 7:
        raise ZeroDivisionError
    findings = [Finding("wrong", "by much")] if number == 3 else []
    return Checked("odd" if number % 2 else "even", {"impacts": 10}, {"size": number}, findings, 0.5)


CASES = Campaign("tests.campaign.cases", None, "case", ("cases", 9), check_number, 3600.0)


@pytest.mark.release
def test_campaign_counts_add_up_over_calls(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A second call continues with the next case, and its table has the cases of both; a finding is exit code 1."""
    state = tmp_path / "state.json"
    for cases, code in ((2, 0), (2, 0), (4, 1)):
        assert CASES.main(["--cases", str(cases), "--jobs", "2", "--state", str(state)]) == code
        assert f"| all | {cases} | {10 * cases} |" in capsys.readouterr().out
        tally = require_value(Tally.load(state))
        assert tally.begun == cases
    assert tally.findings == [(3, "wrong", "by much")]
    assert tally.most == {"even": {"size": 2}, "odd": {"size": 3}}
    later = tmp_path / "later.json"
    assert CASES.main(["--from", "8", "--cases", "2", "--state", str(later)]) == 0
    assert require_value(Tally.load(later)).most == {"even": {"size": 8}, "odd": {"size": 9}}
    assert CASES.main(["--case", "3"]) == 1
    assert "case 3: wrong: by much\n    again: python -m tests.campaign.cases --case 3" in capsys.readouterr().out


@pytest.mark.release
def test_worker_that_hangs_or_crashes_is_replaced() -> None:
    """The case of a worker that hangs or crashes is a finding, and the campaign continues with the next case."""
    tally = Tally(begun=4)
    assert replace(CASES, hanging_s=4.0).run(tally, 5)
    assert tally.differences == {"crash": 2, "raised": 1}
    assert (tally.begun, tally.total("cases")) == (9, 5)


def test_state_file_of_an_earlier_version_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A state file with other keys is refused by its path, with exit code 2, before any case is checked."""
    state = tmp_path / "state.json"
    state.write_text('{"begun": 3, "counts": {}, "findings": []}', encoding="utf-8")
    with pytest.raises(SystemExit) as ended:
        CASES.main(["--cases", "9", "--state", str(state)])
    assert ended.value.code == 2
    assert f"state of an earlier version: delete {state}" in capsys.readouterr().err


@each("factor, rule", [(1e150, "row"), (1.0 + 1e-9, "law")])
def test_kernel_that_gains_energy_violates_a_rule(factor: float, rule: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """A kernel whose speeds grow at every impact, up to overflow, violates a named rule and raises nothing."""

    class Gains(EventDrivenRun):
        def __init__(self, start: DiscArrays, **options: Any) -> None:
            wrong = replace(start)
            for name in ("restitution", "wall_restitution"):
                object.__setattr__(wrong, name, factor)  # beyond what is accepted
            super().__init__(wrong, **options)

    monkeypatch.setattr(gas_checks, "EventDrivenRun", Gains)
    monkeypatch.setattr(gas_checks, "draw_gas", lambda number: draw_gas(number, most_discs=64))
    assert rule in {finding.kind for finding in gas_checks.check_gas(0).findings}


@pytest.mark.release
@pytest.mark.usefixtures("heard_interrupts")
def test_ctrl_c_prints_and_saves_finished_cases(tmp_path: Path) -> None:
    """After Ctrl-C the campaign finishes the current scene; table and state file have the same impacts."""
    state = tmp_path / "campaign.json"
    with subprocess.Popen(
        [sys.executable, "-m", "tests.campaign.features", "--scenes", "1e9", "--state", str(state)],
        cwd=Path(__file__).parents[2],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    ) as process:
        assert " cases, " in require_value(process.stderr).readline()
        process.send_signal(signal.SIGINT)
        table = require_value(process.stdout).read()
        assert process.wait() == campaign.INTERRUPTED
    assert f" {require_value(Tally.load(state)).total('impacts'):,.0f} |" in table


@each("kind", list(Kind))
def test_gas_depends_only_on_its_number(kind: Kind) -> None:
    """The same number gives the same gas, within the campaign's limits of packing."""
    for number in range(6):
        gas, again = draw_gas(number, kind), draw_gas(number, kind)
        assert gas.start.position_m.tobytes() == again.start.position_m.tobytes()
        assert gas.start.velocity_m_s.tobytes() == again.start.velocity_m_s.tobytes()
        assert gas.packing == 0.0 if kind is Kind.OPEN else 0.09 < gas.packing < 0.79


GASES: list[tuple[Kind | None, int, int]] = [
    *((kind, 0, 400) for kind in Kind),
    *((kind, number, 12_500) for kind in Kind for number in (0, 1)),
    *((None, 1000 + number, 100_000) for number in range(20)),
]


@each("kind, number, impacts", release_after(len(Kind), GASES))
def test_gases_of_every_kind_violate_no_rule(kind: Kind | None, number: int, impacts: int) -> None:
    """No impact of a gas violates a rule of the checker, in gases of up to 1000 discs, and of up to 10,000."""
    gas = draw_gas(number, most_discs=10_000) if kind is None else draw_gas(number, kind, most_discs=1000)
    report = gas_checks.check_run(gas, impacts)
    assert [str(violation) for violation in report.violations[:5]] == []
    assert 0 < report.impacts <= impacts
