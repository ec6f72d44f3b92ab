"""The picture and the table of the README: `python docs/figures/readme.py` draws the one and writes the other.

The picture is the report's own, of one scene run by PIC and by an engine. The table counts the rows of the committed
sample, `reports/sample/results.jsonl`, at each scene's coarsest step.
"""

from __future__ import annotations

import re
import statistics
from collections import Counter
from pathlib import Path

from carom import cross_check
from carom.report.grid import build_grid
from carom.report.picture import Divergence, caption, draw_pair
from carom.report.records import read_records
from carom.report.svg import alone
from carom.report.wording import number
from carom.scenes import find_scenes

ROOT = Path(__file__).resolve().parents[2]
SAMPLE = ROOT / "reports" / "sample" / "results.jsonl"
PICTURE = Path(__file__).with_name("missed.svg")

SCENE, ENGINE = "paper/missed", "pymunk"
GRADES = ("exact", "close", "sampled", "inaccurate", "wrong")

#: What stands between them in the README is written by this script.
BEGIN, END = "<!-- made by docs/figures/readme.py -->\n", "<!-- end -->\n"

#: Room between the halves of the picture, and above them for what they show, points.
_GAP, _HEAD = 24.0, 18.0


def picture() -> str:
    """Return the scene by PIC beside the engine's run, as one SVG."""
    results = cross_check(find_scenes([SCENE]), [ENGINE], profiles=["tuned"], timing=False, jobs=1)
    cell = build_grid(results).rows[0].cells[0]
    assert cell.row is not None and cell.row.trace is not None, cell.reasons  # noqa: S101, PT018 - it ran
    shown = Divergence(cell, results.references[SCENE], cell.row.trace)
    labels = ("What must happen, by PIC", f"What happens: {caption(shown)}")
    halves, at = [], 0.0
    width = height = 0.0
    heads = ("what must happen", f"{ENGINE}, at the scene's own {shown.reference.scene.frame_rate_hz:g} steps a second")
    for svg, head in zip(draw_pair(shown, labels), heads, strict=True):
        size = re.search(r'viewBox="0 0 ([\d.]+) ([\d.]+)"', svg)
        assert size is not None  # noqa: S101 - every drawing has its size
        wide, high = float(size[1]), float(size[2])
        inner = svg.replace("<svg ", f'<svg x="{at:g}" y="{_HEAD:g}" width="{wide:g}" height="{high:g}" ', 1)
        halves.append(f'<text x="{at:g}" y="12" font-family="sans-serif" font-size="11">{head}</text>{inner}')
        width, height, at = at + wide, max(height, high + _HEAD), at + wide + _GAP
    box = f'viewBox="0 0 {width:g} {height:g}" width="{width:g}" height="{height:g}"'
    return alone(f'<svg {box} role="img"><rect width="100%" height="100%" fill="#fefefd"/>{"".join(halves)}</svg>')


def table(path: Path = SAMPLE) -> str:
    """Return the README's table: a row an engine with its best fixed-step settings, how many scenes got which grade."""
    head, rows = read_records(path)
    names = {name.lower(): f"{name} {version}" for name, version in head["environment"]["versions"].items()}
    names |= {"pic": "PIC", "pit": "PIT"}
    lines = ["| method | " + " | ".join(GRADES) + " | price paid, median |", "| --- |" + " --- |" * (len(GRADES) + 1)]
    for engine in dict.fromkeys(row["engine"] for row in rows):
        own = [r for r in rows if r["engine"] == engine and r["profile"] == "tuned" and r["refinement"] == 0]
        count = Counter(row["grade"] for row in own)
        paid = [float(row["price_paid"]) for row in own if row["price_paid"] is not None]
        median = number(statistics.median(paid)) if paid else ""
        lines.append(f"| {names[engine]} | " + " | ".join(str(count[grade]) for grade in GRADES) + f" | {median} |")
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    PICTURE.write_text(picture(), encoding="utf-8")
    readme = ROOT / "README.md"
    before, _, rest = readme.read_text(encoding="utf-8").partition(BEGIN)
    readme.write_text(before + BEGIN + table() + END + rest.partition(END)[2], encoding="utf-8")
