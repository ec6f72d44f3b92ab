"""Blocks of results in the README. `make docs-figures` writes these blocks from committed results.

Run time against error is from `reports/bench/bench.json`, which `make docs-bench` writes. Stability is counted in the
table of the full stress campaign, and accuracy in the rows of the committed sample, `reports/sample/results.jsonl`,
with the largest step size of each scene.
"""

from __future__ import annotations

import json
import math
import re
import statistics
from collections import Counter
from importlib import resources
from pathlib import Path
from typing import Any

from docs.figures import stress_tables
from docs.figures.raw_records import read_raw_records

from carom.catalogue import find_scenes
from carom.execution.job import Method
from carom.report.svg import to_separate_svg
from carom.studies.bench.convergence import Convergence, ConvergenceOrder
from carom.studies.bench.document import describe_scene
from carom.studies.bench.figure import render_diagram_svg
from carom.studies.bench.machine_noise import Noise, Spread
from carom.studies.bench.options import Diagram, ErrorKind
from carom.studies.bench.result import Curve, Point, SceneBench
from carom.studies.bench.tables import format_error
from carom.studies.bench.timing_pass import CellTiming
from carom.studies.stress.result import CellEnding, CellResult, StressRow
from carom.studies.stress.run import list_rows
from carom.support.formatting import format_number

ROOT = Path(__file__).resolve().parents[2]
SAMPLE = ROOT / "reports" / "sample" / "results.jsonl"

GRADES = ("exact", "close", "sampled", "inaccurate", "diverged", "diverged inaccurate", "wrong")

BENCH = ROOT / "reports" / "bench" / "bench.json"
FIGURES = ROOT / "docs" / "figures"
CAMPAIGN = stress_tables.PAGE

#: A block: this script writes the text between its first and its last line.
BLOCK = re.compile(r"(<!-- made by docs/figures/readme\.py: (\w+) -->\n)((?s:.*?))(<!-- end -->\n)")

#: Largest error, as a fraction, of the fastest engine that the text names; and the methods of the table of stability.
TARGET = 0.01
STABLE = ("pic event-driven", "box2d tuned", "mujoco tuned", "pybullet tuned", "pymunk tuned")


def table(path: Path = SAMPLE) -> str:
    """Return the README's table: the number of scenes per grade, for each engine with its best fixed-step settings."""
    head, rows = read_raw_records(path)
    names = {name.lower(): f"{name} {version}" for name, version in head["environment"]["versions"].items()}
    names |= {"pic": "PIC", "pit": "PIT"}
    lines = [
        "| method | " + " | ".join(GRADES) + " | error / PIT's, median |",
        "| --- |" + " --- |" * (len(GRADES) + 1),
    ]
    for engine in dict.fromkeys(row["engine"] for row in rows):
        own = [
            r
            for r in rows
            if r["engine"] == engine
            and Method(engine, r["profile"]) == Method(engine, "tuned")
            and r["refinement"] == 0
        ]
        count = Counter(row["grade"] for row in own)
        paid = [float(row["price_paid"]) for row in own if row["price_paid"] is not None]
        median = format_number(statistics.median(paid)) if paid else ""
        counted = [str(count[grade.replace(" ", "_")]) for grade in GRADES]
        lines.append(f"| {names[engine]} | " + " | ".join(counted) + f" | {median} |")
    return "\n".join(lines) + "\n"


def bench_scene(path: Path = BENCH) -> tuple[SceneBench, ErrorKind]:
    """Return the first scene of the committed results of `carom bench`, with the measured error."""
    content = json.loads(path.read_text(encoding="utf-8"))
    found = content["scenes"][0]
    curves = tuple(
        Curve(one["engine"], one["profile"], tuple(map(_point, one["points"])), _order(one["order"]), None)
        for one in found["curves"]
    )
    scene = find_scenes([found["scene"]])[0].scene
    noise = Noise(**found["noise"])
    bench = SceneBench(scene, curves, (), None, noise, found["rounds"], found["timed_at"])
    return bench, ErrorKind(content["plan"]["error"])


def _point(found: dict[str, Any]) -> Point:
    own: dict[str, Any] = {
        name: math.nan if value is None and name.startswith("error") else value for name, value in found.items()
    }
    if (timing := found["timing"]) is not None:
        clocks: dict[str, Any] = {
            name: Spread(**value) if isinstance(value, dict) else value for name, value in timing.items()
        }
        own["timing"] = CellTiming(**clocks)
    return Point(**own)


def _order(found: dict[str, Any]) -> ConvergenceOrder:
    numbers: dict[str, Any] = {name: math.nan if value is None else value for name, value in found.items()}
    return ConvergenceOrder(**numbers | {"verdict": Convergence[found["verdict"].upper()]})


def bench_block() -> str:
    """Return the diagram of run time against error, and its main result as text."""
    scene, kind = bench_scene()
    pit = next(curve.best for curve in scene.curves if curve.engine == "pit")
    alt = f"Error against run time in the scene {scene.scene.name}: PIC is the line at the bottom, engines are above it"
    picture = (
        '<picture><source media="(prefers-color-scheme: dark)" srcset="docs/figures/bench-dark.svg">'
        f'<img alt="{alt}" src="docs/figures/bench-light.svg"></picture>'
    )
    told = describe_scene(scene, TARGET, kind)
    sampling = (
        f"A method that only checks for overlap once per step (PIT) has an error of {format_error(pit.error, kind)}."
        if pit
        else ""
    )
    return f"{picture}\n\n{told} {sampling}\n"


def bench_figures() -> dict[str, str]:
    """Return the diagram in light and in dark colours, by file name."""
    scene, kind = bench_scene()
    light = to_separate_svg(render_diagram_svg(scene, Diagram.ERROR_TIME, kind))
    css = resources.files("carom.report").joinpath("templates/report.css").read_text(encoding="utf-8")
    dark = dict(
        re.findall(r"--([\w-]+): (#[0-9a-f]+)", css.partition("prefers-color-scheme: dark")[2].partition("}")[0])
    )
    text = re.sub(r"var\(--([\w-]+),#[0-9a-f]+\)", lambda found: dark[found[1]], light)
    return {"bench-light.svg": light, "bench-dark.svg": text}


def stability_block() -> str:
    """Return a row per method: the number of stress tests passed, and the test failed at the least extreme value."""
    head, _, *rows = stress_tables.kept(CAMPAIGN.read_text(encoding="utf-8"))["stress test"]
    axes = {line.name: line for line in list_rows()}
    lines = ["| method | tests passed | fails first in | changed quantity | fails at |", "| --- |" + " --- |" * 4]
    for method in STABLE:
        cells = [(axes[row[0]], row[head.index(method)]) for row in rows]
        passed = sum(cell.startswith("= ") for _, cell in cells)
        failed = [
            (line, float(cell.split()[-1])) for line, cell in cells if cell[:2] in ("~ ", "x ") and cell[-1].isdigit()
        ]
        first = min(failed, key=lambda one: _depth(*one), default=None)
        told = (first[0].name, first[0].axis.partition(", ")[0], format_number(first[1])) if first else ("", "", "")
        lines.append(f"| {method} | {passed} of {len(cells)} | {' | '.join(told)} |")
    return "\n".join(lines) + "\n"


def _depth(line: StressRow, value: float) -> float:
    result = CellResult(CellEnding.FAILS_AT_SIZE, value, passes_until=value)
    return (line.compute_depth(result) or 0.0) if value > 0 else 1.0


def blocks() -> dict[str, str]:
    """Return each block of the README by its name."""
    return {"bench": bench_block(), "stability": stability_block(), "accuracy": table()}


if __name__ == "__main__":
    made = blocks()
    readme = ROOT / "README.md"
    text = BLOCK.sub(lambda found: found[1] + made[found[2]] + found[4], readme.read_text(encoding="utf-8"))
    readme.write_text(text, encoding="utf-8")
    for name, drawn in bench_figures().items():
        (FIGURES / name).write_text(drawn, encoding="utf-8")
