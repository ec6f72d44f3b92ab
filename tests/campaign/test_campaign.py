"""The campaign's command: it counts, goes on where it was, and tells what it finds and how to see it again."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
import pytest
from tests.campaign import __main__ as command
from tests.campaign.gases import Kind, draw
from tests.campaign.tally import Tally
from tests.checker import Report, Violation

if TYPE_CHECKING:
    from pathlib import Path


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


@pytest.mark.parametrize("kind", list(Kind))
def test_a_gas_is_drawn_from_its_number_alone(kind: Kind) -> None:
    """The same number gives the same gas, within the sizes and packings that the campaign promises."""
    for number in range(20):
        gas, again = draw(number, kind), draw(number, kind)
        assert gas.start.position_m.tobytes() == again.start.position_m.tobytes()
        assert gas.start.velocity_m_s.tobytes() == again.start.velocity_m_s.tobytes()
        assert 64 <= len(gas.start) <= 10_000
        assert gas.packing == 0.0 if kind is Kind.OPEN else 0.09 < gas.packing < 0.79
        assert np.isfinite(gas.start.mass_kg).any()
