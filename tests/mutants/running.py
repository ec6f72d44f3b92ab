"""A pytest plug-in that tries faults: the tests are collected once, and each fault has a process of its own to fail in.

A process begins as a copy of the one that has collected, so a fault costs no more than the tests up to the first that
fails. Those that have found faults come first, then the shortest.
"""

import json
import math
import os
import resource
import select
import signal
import sys
import time
from collections import Counter
from pathlib import Path

import pytest
from tests.mutants.packages import PACKAGES
from tests.mutants.planting import VARIABLE, Fault

#: Environment variable with the file of what is to be tried.
JOB = "CAROM_MUTANTS"
#: A process that takes this many times the processor time of the tests without a fault, and some seconds more, has no
#: end; nor one that takes many times that by the clock, which a busy machine does not.
_PATIENCE, _PATIENCE_S, _BUSY = 5.0, 20.0, 20.0


class Stage:
    """The tests of a package, in the order in which they are tried."""

    def __init__(self, items: list[pytest.Item], patterns: tuple[str, ...]) -> None:
        self.items = [item for item in items if item.nodeid.startswith(patterns)]
        self.seconds: dict[str, float] = {}
        self.found: Counter[str] = Counter()

    def sort_tests(self) -> list[pytest.Item]:
        """Return the tests, those that have found most faults first."""
        return sorted(self.items, key=lambda item: (-self.found[item.nodeid], self.seconds.get(item.nodeid, 0.0)))


class Failures:
    """Hears which tests have failed."""

    def __init__(self) -> None:
        self.failed = False

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        """Remember a failure, of set-up and tear-down too."""
        self.failed = self.failed or report.failed


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
    """Run a package's tests without a fault, by which is known how long each takes."""
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
        What found it: the first test that fails, "a crash", or "no end"; empty for nothing. And seconds by test.
    """
    reading, writing = os.pipe()
    child = os.fork()
    if child == 0:
        os.close(reading)
        resource.setrlimit(resource.RLIMIT_CPU, (math.ceil(time.process_time() + limit_s), resource.RLIM_INFINITY))
        _run(items, number, fault, writing)
    os.setpgid(child, child)  # also here, or a child that has not run yet could not be killed by its group
    os.close(writing)
    ends_s, said = time.monotonic() + _BUSY * limit_s, b""
    while (left_s := ends_s - time.monotonic()) > 0.0:
        if not select.select([reading], [], [], left_s)[0]:
            continue
        piece = os.read(reading, 2**16)
        if not piece:
            break
        said += piece
    os.close(reading)
    if left_s <= 0.0:
        os.killpg(child, signal.SIGKILL)
    _, status = os.waitpid(child, 0)
    lines = [line.split("\t") for line in said.decode().splitlines()]
    seconds = {name: float(took) for verdict, name, took in lines if verdict == "passed"}
    failed = [name for verdict, name, _ in lines if verdict == "failed"]
    if failed:
        return failed[0], seconds
    endless = left_s <= 0.0 or (os.WIFSIGNALED(status) and os.WTERMSIG(status) == signal.SIGXCPU)
    return ("no end" if endless else "a crash" if status else ""), seconds


def _run(items: list[pytest.Item], number: int, fault: Fault | None, writing: int) -> None:
    """Run tests up to the first that fails, say of each how it ended, and end the process."""
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
    failures = Failures()
    for k, item in enumerate(items):
        began_s = time.process_time()
        item.config.pluginmanager.register(failures, "failures") if k == 0 else None
        try:
            item.config.hook.pytest_runtest_protocol(item=item, nextitem=items[k + 1] if k + 1 < len(items) else None)
        except BaseException:  # noqa: BLE001 - whatever ends it is a failure
            failures.failed = True
        verdict = "failed" if failures.failed else "passed"
        os.write(writing, f"{verdict}\t{item.nodeid}\t{time.process_time() - began_s:.6f}\n".encode())
        if failures.failed:
            break
    os._exit(0)
