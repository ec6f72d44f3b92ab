"""Speed of certified runs, and number of impacts for which PIC agrees: ``python -m benchmarks.certified``.

All times are processor times, because other processes may use the machine. The times include runs that are repeated
with more bits. With ``--baseline``, another version of Carom is timed in turn.
"""

from __future__ import annotations

import statistics
from contextlib import ExitStack
from typing import NamedTuple

from benchmarks.arguments import count, parser, run
from benchmarks.baseline import Interpreter, alternating

from carom import certify, solve_pic
from carom.comparator import compute_horizon
from carom.studies.bench.gas import build_gas_scene

#: Number of discs, fraction of the box that discs fill, and number of impacts of each row. `LONG` is for ``--long``.
GASES = ((16, 0.1, 500), (16, 0.4, 1000), (64, 0.4, 1000), (64, 0.4, 4000), (256, 0.4, 4000))
LONG = (64, 0.4, 30_000)

#: For each line with discs, packing and impacts, prints the seconds of a certified run. Older versions may need to load
#: compiled code first.
_TIMES = """
import sys, time
from carom import certify
from carom.studies.bench.gas import build_gas_scene
try:
    from carom.solvers.certified.lower_bounds import load_compiled
    load_compiled()
except ImportError:
    pass
for line in sys.stdin:
    discs, packing, impacts = line.split()
    scene = build_gas_scene(int(discs), float(packing))
    begin = time.process_time()
    certify(scene, max_impacts=int(impacts))
    print(time.process_time() - begin, flush=True)
"""
#: Prints the seconds of the first certified run of a process, including imports during this run.
_FIRST = """
import sys, time
import carom
from carom.studies.bench.gas import build_gas_scene
scene = build_gas_scene(64, 0.4)
for line in sys.stdin:
    begin = time.process_time()
    carom.certify(scene, max_impacts=int(line))
    print(time.process_time() - begin, flush=True)
"""
_FIRST_IMPACTS = 100


class Measured(NamedTuple):
    """One row of the table: certified impacts, bits, and the number of impacts for which PIC agrees."""

    impacts: int
    precision_bits: int
    bits_lost: float
    replays: int
    agreed: tuple[int, int]
    order_differs: int | None


def measure(discs: int, packing: float, impacts: int) -> Measured:
    """Certify the first impacts of many discs in a box to 15 digits."""
    scene = build_gas_scene(discs, packing)
    certified = certify(scene, max_impacts=impacts)
    pic = solve_pic(scene, max_impacts=impacts)
    near, far = (compute_horizon(certified, pic, tolerance=tolerance) for tolerance in (1e-12, 1e-6))
    return Measured(
        len(certified),
        certified.precision_bits,
        certified.bits_lost / max(len(certified), 1),
        certified.replays,
        (near.agreed, far.agreed),
        near.order_differs,
    )


def main(*, with_long: bool, baseline: str | None, rounds: int) -> None:
    """Print the table."""
    pythons = [None, baseline] if baseline else [None]
    seconds = []
    for _ in range(rounds):
        for python in pythons:
            with Interpreter(_FIRST, python) as interpreter:
                seconds.append(interpreter.ask(str(_FIRST_IMPACTS))[0])
    firsts = [statistics.median(seconds[k :: len(pythons)]) for k in range(len(pythons))]
    print(f"first run of a process, {_FIRST_IMPACTS} impacts of 64 discs, s: {_beside(firsts, '.3f')}")
    print(
        f"{'discs':>6} {'packing':>8} {'impacts':>8} {'impacts/s':>{9 + 16 * bool(baseline)}} {'bits':>6} "
        f"{'bits/impact':>12} {'replays':>8} {'|dv| > 1e-12':>13} {'|dv| > 1e-6':>12} {'order differs':>14}"
    )
    with ExitStack() as stack:
        interpreters = [stack.enter_context(Interpreter(_TIMES, python)) for python in pythons]
        for discs, packing, impacts in (*GASES, *([LONG] if with_long else [])):
            m = measure(discs, packing, impacts)
            rates = [m.impacts / s for s in alternating(interpreters, f"{discs} {packing} {impacts}", rounds)]
            order = "" if m.order_differs is None else str(m.order_differs)
            print(
                f"{discs:6d} {packing:8.1f} {m.impacts:8d} {_beside(rates, '9.0f')} {m.precision_bits:6d} "
                f"{m.bits_lost:12.3f} {m.replays:8d} {m.agreed[0]:13d} {m.agreed[1]:12d} {order:>14}",
                flush=True,
            )


def _beside(numbers: list[float], form: str) -> str:
    """Format a number, the baseline's number and their ratio."""
    own, *other = numbers
    return f"{own:{form}}" + "".join(f" /{number:{form}} = {own / number:.2f}" for number in other)


if __name__ == "__main__":
    command = parser("benchmarks.certified", __doc__)
    command.add_argument(
        "--long", dest="with_long", action="store_true", help="also measure 30,000 impacts of 64 discs"
    )
    command.add_argument("--baseline", metavar="PYTHON", help="Python interpreter with another version of Carom")
    command.add_argument("--rounds", type=count, default=5, help="number of timings; the table shows the median")
    run(command, main)
