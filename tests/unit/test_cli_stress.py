from __future__ import annotations

from pathlib import Path

import pytest
from tests.command import carom_command


def test_the_list_names_every_kind_of_line() -> None:
    """`--list` names attacks, relations and complaints, and runs nothing."""
    result = carom_command("stress", "--list")
    assert result.exit_code == 0
    for name in ("grazing", "boost", "mujoco-441"):
        assert name in result.output


@pytest.mark.usefixtures("in_process")
def test_a_quick_attack_prints_a_table_and_writes_its_files(tmp_path: Path) -> None:
    """One attack on PIT: the table, the summary, the documents, the journal and the scene of its number."""
    result = carom_command("stress", "tunnelling", "-e", "pit", "--quick", "--out", tmp_path)
    assert result.exit_code == 0, result.output
    assert "pit tuned" in result.output
    assert "tunnelling at" in result.output
    names = {path.name for path in tmp_path.iterdir()}
    assert names == {"stress.html", "stress.md", "stress.json", "journal.jsonl", "scenes", ".carom"}
    assert (tmp_path / "scenes" / "tunnelling.pit.tuned.toml").exists()
