"""Speed and reach of certified runs on the hard-disc gas: ``python -m carom.bench.certified [--long]``.

Times are of the processor, since the machine may be shared; replays at higher precision are part of them. Loading
or compiling the bounds is not: a process does it once, and it is printed by itself. The horizon is the impact up to
which float64 PIC agrees with the certified run.
"""

from __future__ import annotations

import time
import timeit
from typing import NamedTuple

import numpy as np

from carom import certify, solve_pic
from carom.bench.arguments import parser, run
from carom.bench.gas import gas_scene
from carom.comparator import horizon_of
from carom.errors import MissingExtraError
from carom.physics.compilation import compiler_installed
from carom.solvers.certified.lower_bounds import load_compiled

__all__ = ["GASES", "Measured", "main", "measure"]

#: Discs, packing and impacts of each row; the last is for `--long`.
GASES = ((16, 0.1, 500), (16, 0.4, 1000), (64, 0.4, 1000), (64, 0.4, 4000), (256, 0.4, 4000))
LONG = (64, 0.4, 30_000)


class Measured(NamedTuple):
    """One row: processor seconds, impacts that were certified, bits, and where float64 parts from the truth."""

    seconds: float
    impacts: int
    precision_bits: int
    bits_lost: float
    replays: int
    agreed: tuple[int, int]
    order_differs: int | None


def measure(discs: int, packing: float, impacts: int) -> Measured:
    """Certify the first impacts of a gas to 15 digits."""
    scene = gas_scene(discs, packing)
    begin = time.process_time()
    certified = certify(scene, max_impacts=impacts)
    seconds = time.process_time() - begin
    pic = solve_pic(scene, max_impacts=impacts)
    near, far = (horizon_of(certified, pic, tolerance=tolerance) for tolerance in (1e-12, 1e-6))
    return Measured(
        seconds,
        len(certified),
        certified.precision_bits,
        certified.bits_lost / max(len(certified), 1),
        certified.replays,
        (near.agreed, far.agreed),
        near.order_differs,
    )


def yardsticks() -> tuple[float, float]:
    """Return nanoseconds of a product of two balls of 500 bits, and of two arrays of 64: what this machine does now."""
    try:
        from flint import arb, ctx
    except ImportError:
        raise MissingExtraError("certify needs python-flint: pip install 'carom[certify]'") from None
    with ctx.workprec(500):
        a, b = arb(2).sqrt(), arb(3).sqrt()
        balls = min(timeit.repeat(lambda: a * b, number=2000, repeat=9)) / 2000
    x = np.linspace(0.0, 1.0, 64)
    return balls * 1e9, min(timeit.repeat(lambda: x * x, number=2000, repeat=9)) / 2000 * 1e9


def main(*, with_long: bool = False) -> None:
    """Print the table."""
    print("a product of two balls of 500 bits: {:.0f} ns; of two arrays of 64: {:.0f} ns".format(*yardsticks()))
    if compiler_installed():
        begin = time.process_time()
        load_compiled()
        print(f"loading or compiling the compiled bounds: {time.process_time() - begin:.2f} s")
    print(
        f"{'discs':>6} {'packing':>8} {'impacts':>8} {'s':>7} {'impacts/s':>10} {'bits':>6} {'bits/impact':>12} "
        f"{'replays':>8} {'|dv| > 1e-12':>13} {'|dv| > 1e-6':>12} {'order differs':>14}"
    )
    for discs, packing, impacts in (*GASES, *([LONG] if with_long else [])):
        m = measure(discs, packing, impacts)
        order = "" if m.order_differs is None else str(m.order_differs)
        print(
            f"{discs:6d} {packing:8.1f} {m.impacts:8d} {m.seconds:7.2f} {m.impacts / m.seconds:10.0f} "
            f"{m.precision_bits:6d} {m.bits_lost:12.3f} {m.replays:8d} {m.agreed[0]:13d} {m.agreed[1]:12d} {order:>14}",
            flush=True,
        )


if __name__ == "__main__":
    command = parser("carom.bench.certified", __doc__)
    command.add_argument("--long", dest="with_long", action="store_true", help="also 30,000 impacts of 64 discs")
    run(command, main)
