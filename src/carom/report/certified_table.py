"""A certified run: the impacts with their proven digits only, and how far it reached."""

from __future__ import annotations

from typing import TYPE_CHECKING

from carom.report.document import Column, Document, Section, Table
from carom.solvers.certified import proven_decimal
from carom.trace import wall_index

if TYPE_CHECKING:
    from carom.solvers.certified import CertifiedTrace

__all__ = ["certified_document"]


def certified_document(certified: CertifiedTrace, most: int) -> Document:
    """Return the first impacts, every digit of them right to one unit in the last, and how far the run reached."""
    table = _impacts(certified, most)
    blocks = (table,) if most and len(certified) else ()
    return Document("Carom: certified", tuple(_summary(certified)), (Section(table.title, blocks),))


def _impacts(certified: CertifiedTrace, most: int) -> Table:
    impacts, radii = certified.trace.impacts, certified.radii
    rows = []
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
        rows.append((str(k), time, bodies, after))
    if len(impacts) > most:
        rows.append(("", f"and {len(impacts) - most} more", "", ""))
    columns = (Column("#", number=True), Column("time, s"), Column("bodies"), Column("velocities after, m/s"))
    return Table(columns, tuple(rows), title=f"{certified.trace.scene.name}: every digit proven")


def _summary(certified: CertifiedTrace) -> list[str]:
    """Say how far the run is certified, and why it ended."""
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
    return lines
