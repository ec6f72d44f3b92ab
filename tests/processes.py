"""Commands that tests run, and whether a process that a test started, or that was started by one, is still there."""

import signal
import subprocess
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import pytest

from carom.execution.job import AdapterTask
from carom.execution.observation.engine_run import ObserveTask

#: Only guards against hanging, in seconds: nothing that is waited for takes this long, even on a busy machine.
PATIENT_S = 120.0


def is_alive(pid: int) -> bool:
    """Whether there is such a process, and it is not dead already."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except (FileNotFoundError, ProcessLookupError):
        return False


def wait_until_ended(*pids: int) -> bool:
    """Whether all of them end: a kill is answered when a process next has its turn."""
    until = time.monotonic() + PATIENT_S
    while any(map(is_alive, pids)) and time.monotonic() < until:
        time.sleep(0.01)
    return not any(map(is_alive, pids))


def read_pid(note: Path) -> int:
    """Wait until a process number is written to a file as a whole line, and return it."""
    until = time.monotonic() + PATIENT_S
    while not (note.exists() and note.read_text().endswith("\n")):
        assert time.monotonic() < until, f"nothing is written to {note}"
        time.sleep(0.01)
    return int(note.read_text())


def wait_until_begun(process: subprocess.Popen[str], begun: Callable[[], object]) -> None:
    """Wait until a process that goes on has begun its work."""
    until = time.monotonic() + PATIENT_S
    while not begun():
        assert process.poll() is None
        assert time.monotonic() < until
        time.sleep(0.05)


def interrupt(process: subprocess.Popen[str]) -> str:
    """Press Ctrl-C, and return what the process prints to stderr before it ends."""
    process.send_signal(signal.SIGINT)
    try:
        return process.communicate(timeout=PATIENT_S)[1]
    finally:
        process.kill()  # of no effect on one that has ended


def limit_only(patch: pytest.MonkeyPatch, *engines: str) -> None:
    """Let a pool's time limit end runs of these engines alone; a busy machine has `PATIENT_S` for anything else."""
    least_s = property(lambda task: 0.0 if task.engine in engines else PATIENT_S)
    patch.setattr(ObserveTask, "min_time_limit_s", least_s, raising=False)
    patch.setattr(AdapterTask, "min_time_limit_s", PATIENT_S)


def run_command(
    command: Sequence[str | Path], *, check: bool = True, **options: Any
) -> subprocess.CompletedProcess[str]:
    """Return what a command has printed, and its exit code, which must be 0 by default."""
    return subprocess.run(command, capture_output=True, text=True, check=check, **options)
