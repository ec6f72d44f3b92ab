"""Document of `carom certify`, and TOML files of catalogue scenes."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
import tomli_w
from numpy.typing import NDArray

from carom.catalogue import BugReport, CatalogueScene
from carom.model.trace import Mode, body_name, pair_name
from carom.report.document import Column, Document, Section, Table
from carom.solvers.certified.result import CertifiedTrace, proven_decimal
from carom.support import formatting


def format_scene_file(entry: CatalogueScene) -> str:
    """Return a scene as a loadable TOML file, with its known answer in comments at the top."""
    lines = [entry.shows, f"Known answer: {entry.known.source}"]
    if entry.known.count is not None:
        lines.append(f"Impacts: {entry.known.count}")
    if entry.known.convention:
        lines.append(f"No unique answer: {entry.known.convention}")
    if isinstance(entry, BugReport):
        lines += [f"Reported for {entry.about}: {entry.summary}", f"Thread: {entry.thread}", entry.number_sources]
    comments = "".join(f"# {line}\n" for line in lines)
    return comments + tomli_w.dumps(entry.scene.model_dump(mode="python"))


def build_certified_document(certified: CertifiedTrace, max_rows: int) -> Document:
    """Return a document that lists the proven digits of the first impacts, and states how far the run is certified."""
    columns = [
        Column("#", str, number=True),
        Column("time, s", lambda k: list_decimals(certified, k)[0]),
        Column("bodies", lambda k: pair_name(certified.trace.impacts[k])),
        Column("velocities after, m/s", lambda k: _format_velocities(certified, k)),
    ]
    if certified.trace.spins is not None:
        columns.append(Column("spins after, rad/s", lambda k: "  ".join(list_decimals(certified, k)[5:])))
    title = f"{certified.trace.scene.name}: every digit is proven"
    table = _build_limited_table(columns, len(certified), max_rows, title)
    blocks: tuple[Table, ...] = (table,) if max_rows and len(certified) else ()
    if max_rows and certified.trace.modes is not None:
        blocks = (*blocks, _build_modes_table(certified, certified.trace.modes, max_rows))
    return Document("Carom: certified", tuple(_describe_reach(certified)), (Section(table.title, blocks),))


def _build_limited_table(columns: Sequence[Column], count: int, max_rows: int, title: str) -> Table:
    """Return a table of the first `max_rows` rows. If there are more rows, a note below the table counts the others."""
    note = f"and {count - max_rows} more" if count > max_rows else ""
    return Table(columns, range(min(max_rows, count)), title=title, note=note)


def _build_modes_table(certified: CertifiedTrace, modes: NDArray[np.void], max_rows: int) -> Table:
    """Return a table of the first times at which a disc begins to fly, slide, roll or rest."""

    def format_proven_number(field: str, *index: int) -> str:
        bound = 0.0 if certified.mode_radii is None else certified.mode_radii[field][index]
        return proven_decimal(float(modes[field][index]), float(bound))

    columns = (
        Column("time, s", lambda k: format_proven_number("time_s", k)),
        Column("disc", lambda k: body_name(int(modes["disc"][k]))),
        Column("on", lambda k: body_name(int(modes["wall"][k]))),
        Column("new mode", lambda k: Mode(modes["after"][k]).name.lower()),
        Column("velocity, m/s", lambda k: "({}, {})".format(*(format_proven_number("velocity", k, c) for c in (0, 1)))),
    )
    return _build_limited_table(columns, len(modes), max_rows, f"{certified.trace.scene.name}: contact")


def list_decimals(certified: CertifiedTrace, k: int) -> Sequence[str]:
    """Return the proven digits of an impact's time, and of its bodies' velocities and spins after the impact."""
    if certified.decimals:
        return certified.decimals[k]
    impact, radius = certified.trace.impacts[k], certified.radii[k]
    sides = [(side, c) for side in ("velocity_first_after", "velocity_second_after") for c in (0, 1)]
    numbers = [(impact["time_s"], radius["time_s"]), *((impact[side][c], radius[side][c]) for side, c in sides)]
    if certified.trace.spins is not None and certified.spin_radii is not None:
        spin_fields = ["first_after"] if impact["second"] < 0 else ["first_after", "second_after"]
        numbers += [(certified.trace.spins[k][side], certified.spin_radii[k][side]) for side in spin_fields]
    return [proven_decimal(float(value), float(bound)) for value, bound in numbers]


def _format_velocities(certified: CertifiedTrace, k: int) -> str:
    _, *velocity = list_decimals(certified, k)
    after = f"({velocity[0]}, {velocity[1]})"
    return after if certified.trace.impacts[k]["second"] < 0 else f"{after}  ({velocity[2]}, {velocity[3]})"


def _describe_reach(certified: CertifiedTrace) -> Iterator[str]:
    """Describe how far the run is certified, and why it ends there."""
    impacts, end_s = formatting.format_count(len(certified), "impact"), certified.trace.end_time_s
    reach = f"certified to {certified.digits} digits for {impacts} in the first {formatting.format_instant(end_s)}"
    cost = f"{certified.precision_bits} bits, {certified.bits_lost:.0f} of them lost; took {certified.elapsed_s:.2f} s"
    yield f"{certified.trace.scene.name}: {reach} of {certified.trace.scene.duration_s:g} s ({cost})."
    yield f"{formatting.capitalise(certified.ending.value)}."
    if certified.degeneracy is not None:
        yield f"{certified.degeneracy}."
    if certified.commuted:
        pairs = formatting.format_count(len(certified.commuted), "pair")
        yield f"The order of impacts is unknown in {pairs} of simultaneous impacts, but does not change the result."
