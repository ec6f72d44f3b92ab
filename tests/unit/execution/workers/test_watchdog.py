"""The keeper of a worker ends it, with all that it started, though somebody holds the worker's input open."""

import os
import pickle
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from tests.processes import PATIENT_S, read_pid, wait_until_ended

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="elsewhere what leaves its group is not found")

KEEPER = [sys.executable, "-m", "carom.execution.workers.watchdog", str(2**31)]


class Starts:
    """What starts a program outside the worker's session when the worker reads it, and is no task."""

    def __init__(self, note: Path) -> None:
        self.note = note

    def __reduce__(self) -> tuple[object, tuple[str]]:
        act = f"__import__('os').system('setsid sleep 3600 & echo $! > {self.note}')"
        return (eval, (f"[{act}] * 0",))


@pytest.fixture
def pipe() -> Iterator[tuple[int, int]]:
    """A pipe whose write end this process holds until the test is over."""
    ends = os.pipe()
    yield ends
    for end in ends:
        os.close(end)


def test_watchdog_ends_started_processes_if_its_parent_dies(pipe: tuple[int, int], tmp_path: Path) -> None:
    """If the parent is killed, a process of another session ends, even if the watchdog's input is open."""
    script = f"import subprocess, time; subprocess.Popen({KEEPER!r}, stdin={pipe[0]}); time.sleep(3600)"
    parent = subprocess.Popen([sys.executable, "-c", script], pass_fds=[pipe[0]], stdout=subprocess.DEVNULL)
    os.write(pipe[1], pickle.dumps(Starts(tmp_path / "note")))
    started = read_pid(tmp_path / "note")
    parent.kill()
    parent.wait(PATIENT_S)
    assert wait_until_ended(started)
