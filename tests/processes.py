"""Commands that tests run, and whether a process that a test started, or that was started by one, is still there."""

from __future__ import annotations

import subprocess
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

#: Long enough for a process to end on a machine that is busy.
PATIENT_S = 60.0


def alive(pid: int) -> bool:
    """Whether there is such a process, and it is not dead already."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except (FileNotFoundError, ProcessLookupError):
        return False


def ended(*pids: int) -> bool:
    """Whether all of them end: a kill is answered when a process next has its turn."""
    until = time.monotonic() + PATIENT_S
    while any(map(alive, pids)) and time.monotonic() < until:
        time.sleep(0.01)
    return not any(map(alive, pids))


def ran(command: Sequence[str | Path], *, check: bool = True, **options: Any) -> subprocess.CompletedProcess[str]:
    """Return what a command has printed, and its exit code, which must be 0 unless told otherwise."""
    return subprocess.run(command, capture_output=True, text=True, check=check, **options)
