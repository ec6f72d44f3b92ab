from __future__ import annotations

from pathlib import Path

from carom.bench.campaign import campaign


def test_a_sweep_killed_three_times_ends_as_one_left_alone(tmp_path: Path) -> None:
    """Killed outright three times and gone on with, a sweep ends with the journal of one that was left alone.

    ``python -m carom.bench.campaign`` does the same with 10,000 cells.
    """
    found = campaign(96, 3, tmp_path)
    assert found.equal
    assert found.lines == 96  # nothing was run twice
    assert all(0 < at < 96 for at in found.kills)
    assert found.kills == tuple(sorted(found.kills))
