"""Draws gas after gas, runs and checks them in processes of their own, and counts."""

from __future__ import annotations

import math
import signal
import sys
import time
from collections.abc import Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from functools import partial
from multiprocessing import get_context
from pathlib import Path

import numpy as np
from tests.campaign.gases import Gas, draw
from tests.campaign.tally import Finding, Tally
from tests.checker import Report, Violation, check, watch

from carom.model.trace import Outcome
from carom.solvers.event_driven.run import EventDrivenRun
from carom.solvers.run import Progress, Run

#: Seconds after which a run ends in any case: an inelastic gas all but comes to rest. As many seconds as 10,000 free
#: flights take or more, so it ends no other.
LONGEST_S = 1e6


class FlightAlone(EventDrivenRun):
    """A fall that ends where lasting contact begins: the checker supports flights and impacts only.

    Another run finds out when that is.
    """

    def __init__(self, gas: Gas) -> None:
        super().__init__(gas)
        self._scout = EventDrivenRun(gas)

    def advance_to(self, time_s: float, max_impacts: int | None = None, progress: Progress | None = None) -> Outcome:
        """Advance up to the first contact."""
        self._scout.advance_to(time_s, max_impacts)
        modes = self._scout.log.modes()
        if modes is None or not len(modes):
            return super().advance_to(time_s, max_impacts, progress)
        super().advance_to(math.nextafter(float(modes["time_s"][0]), math.inf), None, progress)
        return Outcome.AT_REST


def run_of(gas: Gas) -> Run:
    """Return PIC's run of a gas."""
    if gas.gravity_m_s2 != (0.0, 0.0):
        return FlightAlone(gas)
    return EventDrivenRun(gas.start, contact_duration_s=gas.contact_duration_s)


def _renewed(gas: Gas, run: Run) -> Run:
    assert isinstance(run, EventDrivenRun)
    return EventDrivenRun(gas.start, contact_duration_s=gas.contact_duration_s, resume=run.state())


def checked(gas: Gas, impacts: int | None = None) -> Report:
    """Run a gas and check all its impacts, or the first ones, up to the first stretch that breaks a rule."""
    report = Report()
    run = run_of(gas)
    renew = None if isinstance(run, FlightAlone) else partial(_renewed, gas)
    most = gas.impacts if impacts is None else min(gas.impacts, impacts)
    stretches = watch(run, gas.start, LONGEST_S, most, renew)
    try:
        with np.errstate(over="ignore", invalid="ignore"):  # what overflows is beyond every bound, and so found
            for stretch in stretches:
                check(
                    gas.start,
                    stretch,
                    report,
                    gravity_m_s2=gas.gravity_m_s2,
                    contact_duration_s=gas.contact_duration_s,
                )
                if report.violations:
                    break
    except Exception as error:  # noqa: BLE001 - whatever a broken kernel raises is a finding
        note = f"raised {type(error).__name__}: {error}"
        report.violations.append(Violation("end", -1, (), run.time_s, math.inf, 0.0, note))
    return report


def _work(number: int, most_discs: int) -> tuple[Gas, Report, float]:
    begin = time.process_time()
    gas = draw(number, most_discs=most_discs)
    return gas, checked(gas), time.process_time() - begin


def _deaf() -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)


def run_campaign(tally: Tally, state: Path | None, impacts: int, jobs: int, most_discs: int) -> bool:
    """Check gas after gas, from the tally's next one on, until it has a number of impacts; return whether it does."""
    under_way: dict[Future[tuple[Gas, Report, float]], int] = {}
    seconds, before, go_on = 0.0, tally.impacts, True

    def end(*_: object) -> None:
        nonlocal go_on
        go_on = False

    heard = signal.signal(signal.SIGINT, end)
    with ProcessPoolExecutor(jobs, get_context("spawn"), _deaf) as pool:
        while True:
            while go_on and tally.impacts < impacts and len(under_way) < jobs:
                under_way[pool.submit(_work, tally.begun, most_discs)] = tally.begun
                tally.begun += 1
            if not under_way:
                signal.signal(signal.SIGINT, heard)
                return go_on
            done, _ = wait(under_way, return_when=FIRST_COMPLETED)
            for future in done:
                number = under_way.pop(future)
                try:
                    gas, report, spent = future.result()
                except BrokenProcessPool:
                    go_on = False
                    _tell(tally.find([Finding(number, "crash: the process ended in this gas, or in one next to it")]))
                except Exception as error:  # noqa: BLE001 - whatever a broken kernel raises is a finding
                    _tell(tally.find([Finding(number, f"raised {type(error).__name__}: {error}")]))
                else:
                    seconds += spent
                    _tell(tally.add(gas, report))
                    rate = seconds / max(1, tally.impacts - before) * 1e6
                    print(
                        f"{tally.impacts:13,} impacts, {rate:.2f} us of processor time each; gas {number}: "
                        f"{len(gas.start):,} discs, packing {gas.packing:.2f}, {gas.kind}",
                        file=sys.stderr,
                        flush=True,
                    )
            if state is not None:
                tally.save(state)


def _tell(findings: Sequence[Finding]) -> None:
    for finding in findings[:10]:
        print(f"gas {finding.number}: {finding}", flush=True)
