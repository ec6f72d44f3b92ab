"""The command that compares PIC with brute force on random tables: it counts, goes on, and tells of a contradiction."""

from __future__ import annotations

from pathlib import Path

import pytest
from tests.campaign import tables as command
from tests.campaign.tables import Tally, main
from tests.validation.table_runs import Comparison


@pytest.mark.long
def test_counts_of_tables_add_up_over_calls(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A second call goes on with the next table, and its counts hold the impacts of both."""
    state = tmp_path / "tables.json"
    for tables in (1, 3):
        assert main(["--tables", str(tables), "--state", str(state)]) == 0
        tally = Tally.load(state)
        assert tally.tables == tables
        assert f"| all | {tables} | {tally.impacts:,} |" in capsys.readouterr().out
    assert main(["--tables", "9", "--minutes", "0", "--state", str(state)]) == 0
    assert Tally.load(state) == tally


def test_a_contradiction_is_told_with_the_way_to_see_it_again(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """It makes the exit code 1, and the table's number is printed."""
    monkeypatch.setattr(command, "compare", lambda *_: Comparison(3, "contradiction", 7.0))
    assert main(["--tables", "1"]) == 1
    told = capsys.readouterr()
    assert "python -m tests.campaign.tables --table 0" in told.err
    assert "| all | 1 | 3 | 0 | 0 | 0 | 0 | 1 | 7.00 |" in told.out
    assert main(["--table", "0"]) == 1
    assert "ended='contradiction'" in capsys.readouterr().out
