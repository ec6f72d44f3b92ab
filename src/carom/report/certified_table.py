"""A certified run on a terminal: the impacts with their proven digits only, and how far it reached."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rich.table import Table
from rich.text import Text

from carom.solvers.certified import proven_decimal
from carom.trace import wall_index

if TYPE_CHECKING:
    from carom.solvers.certified import CertifiedTrace

__all__ = ["certified_summary", "certified_table"]


def certified_table(certified: CertifiedTrace, most: int) -> Table:
    """Return the first impacts, every digit of them right to one unit in the last."""
    table = Table(title=f"{certified.trace.scene.name}: every digit proven", title_justify="left")
    table.add_column("#", justify="right")
    table.add_column("time, s", no_wrap=True)
    table.add_column("bodies", no_wrap=True)
    table.add_column("velocities after, m/s")
    impacts, radii = certified.trace.impacts, certified.radii
    for k in range(min(most, len(impacts))):
        first, second = int(impacts[k]["first"]), int(impacts[k]["second"])
        if certified.decimals:
            time, *velocity = certified.decimals[k]
        else:
            time = proven_decimal(float(impacts[k]["time_s"]), float(radii[k]["time_s"]))
            velocity = [
                proven_decimal(float(impacts[k][side][c]), float(radii[k][side][c]))
                for side in ("velocity_first_after", "velocity_second_after")
                for c in (0, 1)
            ]
        bodies = f"disc {first}, {f'disc {second}' if second >= 0 else f'wall {wall_index(second)}'}"
        after = f"({velocity[0]}, {velocity[1]})"
        if second >= 0:
            after += f"  ({velocity[2]}, {velocity[3]})"
        table.add_row(str(k), Text(time), Text(bodies), Text(after))
    if len(impacts) > most:
        table.add_row("", f"and {len(impacts) - most} more", "", "")
    return table


def certified_summary(certified: CertifiedTrace) -> str:
    """Return how far the run is certified, and why it ended, in a sentence or two."""
    n = len(certified)
    end = certified.trace.end_time_s
    reach = f"certified to {certified.digits} digits for {n} {'impact' if n == 1 else 'impacts'}, to {end:.6g} s"
    cost = f"{certified.precision_bits} bits, {certified.bits_lost:.0f} lost, {certified.elapsed_s:.2f} s"
    lines = [f"{certified.trace.scene.name}: {reach} of {certified.trace.scene.duration_s:g} s ({cost})."]
    lines.append(f"{certified.ending.value[0].upper()}{certified.ending.value[1:]}.")
    if certified.degeneracy is not None:
        lines.append(f"{certified.degeneracy}.")
    if certified.commuted:
        lines.append(
            f"The order of {len(certified.commuted)} simultaneous impacts makes no difference, and is not certified."
        )
    return "\n".join(lines)
