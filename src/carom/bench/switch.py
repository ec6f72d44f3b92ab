"""When compiled code pays: ``python -m carom.bench.switch``.

A unit costs once: to be compiled, or, where that was done before, to be loaded. Then each impact, or each element of an
array, costs less. The break-even points stand in the code where it chooses (`carom.solvers.event_driven.run`,
`carom.physics.time_of_impact`, `carom.solvers.certified.lower_bounds`). Times are of the processor, since the machine
may be shared; those of a unit are of a process that has not imported llvmlite yet. Compiling is numba's and
LLVM's work, or LLVM's alone for units that came translated with the package.
"""

from __future__ import annotations

import math
import os
import statistics
import subprocess
import sys
import tempfile
import time
from typing import TYPE_CHECKING

import numpy as np

from carom import certify
from carom.bench.arguments import parser, run
from carom.bench.gas import gas_scene, hard_disc_gas
from carom.bench.time_of_impact import pairs_of_class
from carom.physics.time_of_impact import pair_times
from carom.solvers.certified.lower_bounds import load_compiled
from carom.solvers.event_driven.run import EventDrivenRun
from carom.solvers.kernel_state import compiled_kernel

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

__all__ = ["UNITS", "main"]


def _load_array_form() -> None:
    pair_times(*np.zeros((10, 1)), compiled=True)


#: What loads the units of each place that chooses.
UNITS: dict[str, Callable[[], object]] = {
    "event-driven run": compiled_kernel,
    "time of impact": _load_array_form,
    "certified bounds": load_compiled,
}
_STARTS = 5
_ROUNDS = 5


def unit_seconds(name: str) -> tuple[float, float]:
    """Return seconds to compile a unit, and to load it: one time, and a median."""
    code = (
        "import os; from carom.bench.switch import UNITS\n"
        f"begin = sum(os.times()[:4]); UNITS[{name!r}](); print(sum(os.times()[:4]) - begin)"  # numba's process counts
    )
    with tempfile.TemporaryDirectory() as directory:
        environment = os.environ | {"CAROM_CACHE_DIR": directory}
        command = [sys.executable, "-c", code]
        first, *others = (
            float(subprocess.run(command, env=environment, check=True, capture_output=True, text=True).stdout)  # noqa: S603 - our own interpreter and text
            for _ in range(1 + _STARTS)
        )
    return first, statistics.median(others)


def impact_seconds(discs: int = 64, packing: float = 0.3, impacts: int = 500) -> list[float]:
    """Return seconds an impact of the event-driven kernel, as plain Python and compiled."""
    plain, compiled = (EventDrivenRun(hard_disc_gas(discs, packing), compiled=compiled) for compiled in (False, True))

    def advance(run: EventDrivenRun) -> None:
        run.advance_to(math.inf, run.impacts + impacts)

    return _median_seconds([lambda: advance(plain), lambda: advance(compiled)], impacts)


def element_seconds(elements: int = 200_000) -> list[float]:
    """Return seconds an element of the array form of the time of impact, in NumPy and compiled."""
    columns = np.ascontiguousarray(pairs_of_class("as they come", elements))
    forms = (lambda: pair_times(*columns, compiled=False), lambda: pair_times(*columns, compiled=True))
    return _median_seconds(forms, elements)


def bounded_seconds(discs: int = 64, packing: float = 0.4, impacts: int = 200) -> list[float]:
    """Return seconds an impact of a certified run, bounded in NumPy and compiled: to be called once in a process."""
    scene = gas_scene(discs, packing)
    times = []
    for _ in range(2):
        times.append(_median_seconds([lambda: certify(scene, max_impacts=impacts)], impacts, rounds=3)[0])
        load_compiled()
    return times


def _median_seconds(forms: Sequence[Callable[[], object]], count: int, rounds: int = _ROUNDS) -> list[float]:
    """Return the median time of each form for one of `count` items, timed in turn."""
    times: list[list[float]] = [[] for _ in forms]
    for _ in range(rounds):
        for form, seconds in zip(forms, times, strict=True):
            begin = time.process_time()
            form()
            seconds.append((time.process_time() - begin) / count)
    return [statistics.median(seconds) for seconds in times]


def main() -> None:
    """Print the table."""
    print(f"{'':18}{'compile, s':>12}{'load, s':>9}{'plain, us':>11}{'compiled, us':>14}{'pays from':>24}")
    measures: tuple[Callable[[], list[float]], ...] = (impact_seconds, element_seconds, bounded_seconds)
    for name, measure in zip(UNITS, measures, strict=True):
        plain, compiled = measure()
        compiling, loading = unit_seconds(name)
        pays = f"{loading / (plain - compiled):.0f}, or {compiling / (plain - compiled):.0f}"
        print(
            f"{name:18}{compiling:12.2f}{loading:9.3f}{plain * 1e6:11.3f}{compiled * 1e6:14.3f}{pays:>24}", flush=True
        )


if __name__ == "__main__":
    run(parser("carom.bench.switch", __doc__), main)
