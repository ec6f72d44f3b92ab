"""Runs of PIC of the campaign's gases, each impact checked by `tests.checker`."""

import math
import time
from functools import partial

import numpy as np
from tests.campaign.campaign import Checked, Finding
from tests.campaign.gases import Gas, draw_gas
from tests.checker import Report, check, watch

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
        super().__init__(gas.scene)
        self._scout = EventDrivenRun(gas.scene)

    def advance_to(self, time_s: float, max_impacts: int | None = None, progress: Progress | None = None) -> Outcome:
        """Advance up to the first contact."""
        self._scout.advance_to(time_s, max_impacts)
        modes = self._scout.log.modes()
        if modes is None or not len(modes):
            return super().advance_to(time_s, max_impacts, progress)
        super().advance_to(math.nextafter(float(modes["time_s"][0]), math.inf), None, progress)
        return Outcome.AT_REST


def build_run(gas: Gas) -> Run:
    """Return PIC's run of a gas."""
    if gas.gravity_m_s2 != (0.0, 0.0):
        return FlightAlone(gas)
    return EventDrivenRun(gas.start, contact_duration_s=gas.contact_duration_s)


def _resume_run(gas: Gas, run: Run) -> Run:
    assert isinstance(run, EventDrivenRun)
    return EventDrivenRun(gas.start, contact_duration_s=gas.contact_duration_s, resume=run.state())


def check_run(gas: Gas, impacts: int | None = None) -> Report:
    """Run a gas and check all its impacts, or the first ones, up to the first stretch that breaks a rule."""
    report = Report()
    run = build_run(gas)
    renew = None if isinstance(run, FlightAlone) else partial(_resume_run, gas)
    most = gas.impacts if impacts is None else min(gas.impacts, impacts)
    stretches = watch(run, gas.start, LONGEST_S, most, renew)
    with np.errstate(over="ignore", invalid="ignore"):  # what overflows is beyond every bound, and so found
        for stretch in stretches:
            check(gas.start, stretch, report, gravity_m_s2=gas.gravity_m_s2, contact_duration_s=gas.contact_duration_s)
            if report.violations:
                break
    return report


def check_gas(number: int) -> Checked:
    """Return what a campaign counts of the gas of a number."""
    begin_s = time.process_time()
    gas = draw_gas(number)
    report = check_run(gas)
    return Checked(
        str(gas.kind),
        {"impacts": report.impacts, "pairs of flights": report.pairs},
        {"discs": len(gas.start), "largest gap": report.worst_gap, "deepest overlap": report.worst_overlap},
        findings=[Finding(one.rule, str(one).partition(": ")[2]) for one in report.violations],
        seconds=time.process_time() - begin_s,
    )
