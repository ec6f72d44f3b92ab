from __future__ import annotations

from pathlib import Path

import pytest

from carom.errors import InputError
from carom.stress.journal import Journal
from carom.stress.results import Ending, Spot

STAMP = {"quick": True, "carom": "0"}
FIRST = Spot("attack", "grazing", "pit/tuned", Ending.GIVES_WAY, 0.003, 0.004, 0.05, "why", ("scenes/a.toml",), 12)
SECOND = Spot("relation", "boost", "pic/tuned", Ending.NOT_RUN, reason="unavailable")


def written(path: Path) -> None:
    with Journal(path, STAMP, resume=False) as journal:
        journal.add(FIRST)
        journal.add(SECOND)


def test_finished_cells_come_back(tmp_path: Path) -> None:
    """What was written down is taken up again, equal in every field."""
    path = tmp_path / "out" / "journal.jsonl"
    written(path)
    with Journal(path, STAMP, resume=True) as journal:
        assert list(journal.spots.values()) == [FIRST, SECOND]


def test_a_torn_last_line_is_done_over(tmp_path: Path) -> None:
    """A line that an interruption tore is left out, and what is added after it is whole."""
    path = tmp_path / "journal.jsonl"
    written(path)
    path.write_text(path.read_text()[:-30])
    with Journal(path, STAMP, resume=True) as journal:
        assert list(journal.spots.values()) == [FIRST]
        journal.add(SECOND)
    with Journal(path, STAMP, resume=True) as journal:
        assert list(journal.spots.values()) == [FIRST, SECOND]


def test_another_campaigns_journal_is_refused(tmp_path: Path) -> None:
    """Cells of another version or form are never mixed in; the message says what to do."""
    path = tmp_path / "journal.jsonl"
    written(path)
    with pytest.raises(InputError, match="leave out --resume"):
        Journal(path, {**STAMP, "quick": False}, resume=True)


def test_without_resume_a_journal_that_holds_cells_is_refused(tmp_path: Path) -> None:
    """Nothing that a campaign has written is lost by starting another one in its folder."""
    path = tmp_path / "journal.jsonl"
    written(path)
    before = path.read_bytes()
    with pytest.raises(InputError, match="holds results already"):
        Journal(path, STAMP, resume=False)
    assert path.read_bytes() == before


def test_two_campaigns_do_not_write_one_journal(tmp_path: Path) -> None:
    """While one campaign writes, another in the same folder is refused, and empties nothing."""
    path = tmp_path / "journal.jsonl"
    with Journal(path, STAMP, resume=False) as journal:
        journal.add(FIRST)
        with pytest.raises(InputError, match="another process"):
            Journal(path, STAMP, resume=True)
    with Journal(path, STAMP, resume=True) as journal:
        assert list(journal.spots.values()) == [FIRST]
