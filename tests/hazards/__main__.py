"""Measure the hazards of engines: `python -m tests.hazards [ENGINE...] [--figures FILE] [--write PAGE]`.

The figures of the named engines, by default all, replace theirs in the file.
"""

import argparse
import json
import sys
from pathlib import Path

from tests.hazards.measures import ENGINES, Figure, measure_engines
from tests.hazards.page import render_lines, render_page
from tests.hazards.spread import Spread

from carom.engines.registry import explain_unavailable_adapter, load_adapter
from carom.execution.describe_engines import engines


def main() -> int:
    """Measure, print the rows of each engine, and write the page if `--write` is given."""
    parser = argparse.ArgumentParser(prog="python -m tests.hazards", description=__doc__)
    parser.add_argument("engines", nargs="*", default=ENGINES, help="which engines (all)")
    parser.add_argument("--figures", type=Path, help="keep the figures in this file, which `make atlas` reads")
    parser.add_argument("--write", type=Path, help="write the page; figures of every engine must be there")
    asked = parser.parse_args()
    names = list(asked.engines)
    missing = {name: reason for name in names if (reason := explain_unavailable_adapter(load_adapter(name)))}
    for name, reason in missing.items():
        sys.stderr.write(f"{name}: {reason}\n")
    if missing:
        return 3
    kept: Path | None = asked.figures
    figures = [_figure(row) for row in json.loads(kept.read_text("utf-8"))] if kept and kept.exists() else []
    for name in names:
        own = list(measure_engines((name,)))
        figures = [figure for figure in figures if figure.engine != name] + own
        sys.stdout.write("".join(f"{line}\n" for line in render_lines(own)))
        sys.stdout.flush()
        if kept:
            kept.write_text(json.dumps([_record(figure) for figure in figures], indent=1), encoding="utf-8")
    if asked.write:
        figures.sort(key=lambda figure: ENGINES.index(figure.engine))
        if lacking := [name for name in ENGINES if name not in {figure.engine for figure in figures}]:
            sys.stderr.write(f"no figures of {', '.join(lacking)}\n")
            return 3
        versions = ", ".join(f"{one.engine} {one.version}" for one in engines(ENGINES))
        asked.write.write_text(
            render_page(figures, [load_adapter(name) for name in ENGINES], versions), encoding="utf-8"
        )
    return 0


def _record(figure: Figure) -> dict[str, object]:
    """Return a figure as JSON: its values, and the numbers that are computed from them."""
    spread = figure.spread
    names = {"table": figure.table, "of": figure.of, "engine": figure.engine, "profile": figure.profile}
    if spread is None:
        return {**names, "refused": figure.refused}
    numbers = {"least": spread.least, "median": spread.median, "most": spread.most, "right": spread.right}
    counts = {"starts_off": spread.starts_off, "starts": len(spread.values)}
    return {**names, **numbers, **counts, "values": list(spread.values)}


def _figure(row: dict[str, object]) -> Figure:
    """Return the figure of a record."""
    table, of, engine, profile = (str(row[name]) for name in ("table", "of", "engine", "profile"))
    values, right = row.get("values"), row.get("right")
    if not isinstance(values, list) or not isinstance(right, float):
        return Figure(table, of, engine, profile, None, str(row["refused"]))
    return Figure(table, of, engine, profile, Spread(tuple(map(float, values)), right))


if __name__ == "__main__":
    raise SystemExit(main())
