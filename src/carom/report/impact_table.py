"""Impact by impact: the reference beside what a method found, for the terminal."""

from __future__ import annotations

import math
from collections.abc import Iterator

from rich.table import Table
from rich.text import Text

from carom.comparator import Score
from carom.runner import Results, Row
from carom.trace import Trace, wall_index

__all__ = ["impact_tables"]

#: Impact by impact is for somebody who looks at one scene on an engine or two: more than this is for the report.
MOST_TABLES = 4
MOST_IMPACTS = 40


def impact_tables(results: Results) -> Iterator[Table]:
    """Yield a table for each row that was run, where there are few enough rows to read one by one."""
    rows = [row for row in results.rows if row.trace is not None and row.score is not None]
    if len(rows) <= MOST_TABLES:
        for row in rows:
            yield _impact_table(row, results.references[row.cell.scene.name])


def _impact_table(row: Row, reference: Trace) -> Table:
    cell, score = row.cell, row.score
    assert score is not None  # noqa: S101 - the caller chose rows that were run
    title = f"{cell.scene.name} on {cell.engine} ({cell.profile}), dt = {cell.dt_s:.6g} s: {score.grade.value}"
    caption = "\n".join(f"{finding.verdict.value} ({finding.reason})" for finding in score.findings)
    table = Table(title=Text(title), caption=Text(caption), title_justify="left", caption_justify="left")
    table.add_column("bodies")
    for heading in ("PIC, s", "reported, s", "path turned, s", "velocity error", "direction, degrees", "restitution"):
        table.add_column(heading, justify="right")
    by_reference = {error.reference: error for error in score.errors}
    for k, impact in enumerate(reference.impacts[:MOST_IMPACTS]):
        time = float(impact["time_s"])
        bodies = _bodies(int(impact["first"]), int(impact["second"]))
        error = by_reference.get(k)
        if error is None:
            table.add_row(bodies, f"{time:.9g}", _not_found(k, score), "", "", "", "")
            continue
        table.add_row(
            bodies,
            f"{time:.9g}",
            f"{time + error.reported_time_s:.9g}",
            "" if math.isnan(error.effective_time_s) else f"{time + error.effective_time_s:.9g}",
            f"{error.velocity:.3g}",
            f"{math.degrees(error.direction_rad):.3g}",
            "" if math.isnan(error.restitution) else f"{error.restitution:.6g}",
        )
    if len(reference.impacts) > MOST_IMPACTS:
        table.add_row(f"and {len(reference.impacts) - MOST_IMPACTS} more", "", "", "", "", "", "")
    assert row.trace is not None  # noqa: S101 - the caller chose rows that were run
    for k in score.spurious:
        impact = row.trace.impacts[k]
        bodies = _bodies(int(impact["first"]), int(impact["second"]))
        table.add_row(bodies, "does not happen", f"{float(impact['time_s']):.9g}", "", "", "", "")
    return table


def _not_found(k: int, score: Score) -> str:
    if k >= score.expected:
        return "beyond the horizon"
    return "not found" if k in score.undecided else "missed"


def _bodies(first: int, second: int) -> str:
    return f"{first} - {second}" if second >= 0 else f"{first} - wall {wall_index(second)}"
