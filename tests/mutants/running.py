"""A pytest plug-in that tries faults: it collects the tests once, and forks a process for each fault.

So a fault takes only the time of the tests up to the first that fails. Tests that noticed faults run first, then the
shortest tests.
"""

import contextlib
import json
import math
import os
import resource
import signal
import sys
import tempfile
import threading
import time
from collections import Counter
from pathlib import Path

import pytest
from tests.mutants.packages import PACKAGES
from tests.mutants.planting import VARIABLE, Fault

#: Environment variable with the path of the job: faults, time limit and the file for results.
JOB = "CAROM_MUTANTS"
#: A process counts as endless if it takes this many times the processor time of the tests without a fault, plus some
#: seconds, or `_BUSY` times that limit by the clock.
_PATIENCE, _PATIENCE_S, _BUSY = 5.0, 20.0, 20.0


class Stage:
    """The tests of a package, their times, and the number of faults that each one noticed."""

    def __init__(self, items: list[pytest.Item], patterns: tuple[str, ...]) -> None:
        self.items = [item for item in items if item.nodeid.startswith(patterns)]
        self.seconds: dict[str, float] = {}
        self.found: Counter[str] = Counter()

    def sort_tests(self) -> list[pytest.Item]:
        """Return the tests, those that noticed the most faults first, then the shortest."""
        return sorted(self.items, key=lambda item: (-self.found[item.nodeid], self.seconds.get(item.nodeid, 0.0)))


def pytest_runtestloop(session: pytest.Session) -> bool:
    """Try every fault of the job instead of running the tests."""
    job = json.loads(Path(os.environ[JOB]).read_text())
    faults = [(number, Fault(*fault)) for number, fault in job["faults"]]
    ends_s, stages = time.monotonic() + job["seconds"], dict[str, Stage]()
    with Path(job["results"]).open("a") as results:
        for number, fault in faults:
            if time.monotonic() > ends_s:
                break
            if fault.package not in stages:
                stages[fault.package] = _run_without_fault(session, fault.package)
            stage = stages[fault.package]
            limit_s = _PATIENCE * sum(stage.seconds.values()) + _PATIENCE_S
            by, _ = run_with_fault(stage.sort_tests(), number, fault, limit_s)
            if by in stage.seconds:
                stage.found[by] += 1
            print(
                json.dumps({"key": fault.key, "package": fault.package, "line": fault.line, "by": by}),
                file=results,
                flush=True,
            )
    return True


def _run_without_fault(session: pytest.Session, package: str) -> Stage:
    """Run the tests of a package without a fault, to measure their times."""
    stage = Stage(session.items, PACKAGES[package].tests)
    by, stage.seconds = run_with_fault(stage.items, 0, None, 3600.0)
    if by or not stage.items:
        raise pytest.UsageError(f"the tests of {package} fail without a fault: {by or 'there are none'}")
    return stage


def run_with_fault(
    items: list[pytest.Item], number: int, fault: Fault | None, limit_s: float
) -> tuple[str, dict[str, float]]:
    """Run tests in a process that has a fault.

    Returns:
        The first test that fails, "a crash" or "no end" (empty if no test notices the fault), and seconds by test.
    """
    with tempfile.TemporaryFile("w+") as verdicts:
        child = os.fork()
        if child == 0:
            resource.setrlimit(resource.RLIMIT_CPU, (math.ceil(time.process_time() + limit_s), resource.RLIM_INFINITY))
            _run(items, number, fault, verdicts.fileno())
        os.setpgid(child, child)  # also here, or a child that has not run yet could not be killed by its group
        watchdog = threading.Timer(_BUSY * limit_s, os.killpg, (child, signal.SIGKILL))
        watchdog.start()
        _, status = os.waitpid(child, 0)
        watchdog.cancel()
        watchdog.join()
        with contextlib.suppress(ProcessLookupError):
            os.killpg(child, signal.SIGKILL)  # processes that it has left behind
        verdicts.seek(0)
        lines = [line.rstrip().split("\t") for line in verdicts]
    seconds = {name: float(took) for verdict, name, took in lines if verdict == "passed"}
    failed = [name for verdict, name, _ in lines if verdict == "failed"]
    if failed:
        return failed[0], seconds
    is_endless = os.WIFSIGNALED(status) and os.WTERMSIG(status) in (signal.SIGKILL, signal.SIGXCPU)
    return ("no end" if is_endless else "a crash" if status else ""), seconds


def _run(items: list[pytest.Item], number: int, fault: Fault | None, writing: int) -> None:
    """Run tests up to the first that fails, write the verdict of each to the file, and end the process."""
    os.setpgid(0, 0)
    silence = os.open(os.devnull, os.O_WRONLY)
    os.dup2(silence, 1)
    os.dup2(silence, 2)
    os.environ[VARIABLE] = str(number)
    from carom.planted import NUMBER  # type: ignore[import-not-found,unused-ignore] # made with the faults

    NUMBER[0] = number
    if fault is not None and fault.constant:
        name = fault.path.removeprefix("src/").removesuffix(".py").replace("/", ".")
        module = sys.modules.get(name) or __import__(name, fromlist=["*"])
        setattr(module, fault.constant, 2 * getattr(module, fault.constant))
    for item, following in zip(items, [*items[1:], None], strict=True):
        begin_s = time.process_time()
        try:
            item.config.hook.pytest_runtest_protocol(item=item, nextitem=following)
            has_failed = item.session.testsfailed > 0
        except BaseException:  # noqa: BLE001 - any exception here is a failure
            has_failed = True
        verdict = "failed" if has_failed else "passed"
        os.write(writing, f"{verdict}\t{item.nodeid}\t{time.process_time() - begin_s:.6f}\n".encode())
        if has_failed:
            break
    os._exit(0)
