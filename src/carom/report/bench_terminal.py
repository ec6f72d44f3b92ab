"""A bench on a terminal."""

from __future__ import annotations

from collections.abc import Iterator

from rich import box
from rich.table import Table
from rich.text import Text

from carom.bench.results import Bench
from carom.report.bench_tables import TableOf, all_tables, cheapest_sentence, noise_sentence, stamp, unrun_lines

__all__ = ["bench_lines", "rich_table"]

_MIN_WIDTH = 78


def rich_table(table: TableOf) -> Table:
    """Return a table in words as one for the terminal."""
    shown = Table(
        title=Text(table.title, style="italic"),
        caption=Text(table.note),
        title_justify="left",
        caption_justify="left",
        pad_edge=False,
        box=box.SIMPLE_HEAD,
        min_width=_MIN_WIDTH,
    )
    kept = [k for k, name in enumerate(table.head) if name not in table.page_only]
    for k in kept:
        shown.add_column(Text(table.head[k]), justify="left" if k < table.left else "right")
    for row in table.rows:
        shown.add_row(*(Text(row[k]) for k in kept))
    return shown


def bench_lines(bench: Bench) -> Iterator[Table | str]:
    """Return what is printed, in order: for each scene its tables and its sentence, then how it was made."""
    for scene in bench.scenes:
        for table in all_tables(scene, bench.plan.error.meaning, bench.plan.target):
            yield rich_table(table)
        yield from unrun_lines(scene)
        if scene.noise is not None:
            yield f"noise: {noise_sentence(scene.noise)}; {scene.rounds} rounds in random order, seed {bench.plan.seed}"
            yield cheapest_sentence(scene, bench.plan.target)
    yield "\n".join(line for line in stamp(bench) if line)
