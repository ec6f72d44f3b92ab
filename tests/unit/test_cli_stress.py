from __future__ import annotations

from pathlib import Path

import pytest
from typer.testing import CliRunner, Result

from carom.cli import app
from carom.studies.stress import run as campaign


def stress(*arguments: object) -> Result:
    return CliRunner().invoke(app, ["stress", *map(str, arguments)])


def test_the_list_names_every_kind_of_line() -> None:
    """`--list` names attacks, relations and complaints, and runs nothing."""
    result = stress("--list")
    assert result.exit_code == 0
    for name in ("grazing", "boost", "mujoco-441"):
        assert name in result.output


@pytest.mark.usefixtures("in_process")
def test_a_quick_attack_prints_a_table_and_writes_its_files(tmp_path: Path) -> None:
    """One attack on PIT: the table, the summary, the documents, the journal and the scene of its number."""
    result = stress("tunnelling", "-e", "pit", "--quick", "--out", tmp_path)
    assert result.exit_code == 0, result.output
    assert "pit tuned" in result.output
    assert "tunnelling at" in result.output
    names = {path.name for path in tmp_path.iterdir()}
    assert names == {"stress.html", "stress.md", "stress.json", "journal.jsonl", "scenes", ".carom"}
    assert (tmp_path / "scenes" / "tunnelling.pit.tuned.toml").exists()


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("grasing",), "no stress test is named 'grasing'"),
        (("grazing", "-e", "bullet"), "no engine is named 'bullet'"),
        (("grazing", "-p", "best"), "no engine asked for has a profile 'best'"),
        (("grazing", "--time-limit", "0"), "--time-limit must be a positive number of seconds, 1e+07 at most, got '0'"),
    ],
)
def test_bad_input_is_a_sentence_and_exit_code_2(arguments: tuple[str, ...], words: str, tmp_path: Path) -> None:
    """A name or number that is wrong is said in a sentence, before anything runs."""
    result = stress(*arguments, "--out", tmp_path)
    assert result.exit_code == 2
    assert words in result.output


@pytest.mark.long
def test_the_journal_of_another_form_is_refused(tmp_path: Path) -> None:
    """Quick cells are not mixed into a full campaign; the message says what to do."""
    assert stress("small", "-e", "pit", "--quick", "--out", tmp_path).exit_code == 0
    result = stress("small", "-e", "pit", "--resume", "--out", tmp_path)
    assert result.exit_code == 2
    assert "its quick is True, and this one's False hint: name another folder" in " ".join(result.output.split())


def _interrupted(*_arguments: object) -> None:
    raise KeyboardInterrupt


@pytest.mark.long
def test_ctrl_c_says_how_to_go_on(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Interrupted, the command ends with 130, names the journal, and says how to take it up."""
    assert stress("small", "-e", "pit", "--quick", "--out", tmp_path).exit_code == 0
    monkeypatch.setattr(campaign.TableCell, "answer", _interrupted)
    result = stress("tunnelling", "-e", "pit", "--quick", "--resume", "--out", tmp_path)
    assert result.exit_code == 130
    assert "--resume" in result.output
    assert str(tmp_path / "journal.jsonl") in result.output


@pytest.mark.long
def test_ctrl_c_before_the_first_cell_leaves_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Interrupted before anything is finished, the command ends with 130 and names no journal, for there is none."""
    monkeypatch.setattr(campaign.TableCell, "answer", _interrupted)
    result = stress("small", "-e", "pit", "--quick", "--out", tmp_path)
    assert result.exit_code == 130
    assert "--resume" not in result.output
    assert not (tmp_path / "journal.jsonl").exists()
