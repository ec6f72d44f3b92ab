"""The large file of the benchmark of memory is one that Carom reads, and the second one differs where it says."""

from __future__ import annotations

from pathlib import Path

import pytest
from benchmarks.memory import CHANGED, write_copies

from carom.report.results_file.file import read_records
from carom.studies.diff.run import diff


@pytest.mark.long
def test_copies_are_read_and_differ_in_one_row_of_twenty(tmp_path: Path) -> None:
    """Each row is a cell of its own, and each changed row that has errors is a change."""
    old, new = tmp_path / "old.jsonl", tmp_path / "new.jsonl"
    write_copies(old, 1300, changed=False)
    write_copies(new, 1300, changed=True)
    _, lines = read_records(old)
    assert len({(line.scene, line.engine, line.profile, line.dt_s) for line in lines}) == 1300
    assert len(diff(old, new).changes) == sum(line.total is not None for line in lines[::CHANGED])
