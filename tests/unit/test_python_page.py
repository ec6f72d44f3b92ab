"""What docs/python.md shows is what happens."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

PAGE = Path(__file__).resolve().parents[2] / "docs" / "python.md"


@pytest.mark.long
def test_the_blocks_run_one_after_the_other(tmp_path: Path) -> None:
    """All Python of the page as one script ends well, with the picture and the replay written, and grades printed."""
    pytest.importorskip("pandas")
    blocks = re.findall(r"```python\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)
    assert len(blocks) == 5
    (tmp_path / "script.py").write_text("".join(blocks), encoding="utf-8")
    environment = {**os.environ, "MPLBACKEND": "agg"}
    done = subprocess.run(
        [sys.executable, "-W", "error", "script.py"],
        cwd=tmp_path,
        env=environment,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith("Score: wrong\n  0 of 1 impact found, 1 missed")
    assert "velocity_first_after_x_m_s" in done.stdout
    assert {path.name for path in tmp_path.iterdir()} == {"script.py", "glance.png", "glance.html"}
