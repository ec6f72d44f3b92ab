"""The table of the README: `python docs/figures/readme.py` writes it.

It counts the rows of the committed sample, `reports/sample/results.jsonl`, at each scene's coarsest step.
"""

from __future__ import annotations

import statistics
from collections import Counter
from pathlib import Path

from carom.pages.records import raw_records
from carom.pages.wording import number

ROOT = Path(__file__).resolve().parents[2]
SAMPLE = ROOT / "reports" / "sample" / "results.jsonl"

GRADES = ("exact", "close", "sampled", "inaccurate", "parted", "parted inaccurate", "wrong")

#: What stands between them in the README is written by this script.
BEGIN, END = "<!-- made by docs/figures/readme.py -->\n", "<!-- end -->\n"


def table(path: Path = SAMPLE) -> str:
    """Return the README's table: a row an engine with its best fixed-step settings, how many scenes got which grade."""
    head, rows = raw_records(path)
    names = {name.lower(): f"{name} {version}" for name, version in head["environment"]["versions"].items()}
    names |= {"pic": "PIC", "pit": "PIT"}
    lines = [
        "| method | " + " | ".join(GRADES) + " | error / PIT's, median |",
        "| --- |" + " --- |" * (len(GRADES) + 1),
    ]
    for engine in dict.fromkeys(row["engine"] for row in rows):
        own = [r for r in rows if r["engine"] == engine and r["profile"] == "tuned" and r["refinement"] == 0]
        count = Counter(row["grade"] for row in own)
        paid = [float(row["price_paid"]) for row in own if row["price_paid"] is not None]
        median = number(statistics.median(paid)) if paid else ""
        counted = [str(count[grade.replace(" ", "_")]) for grade in GRADES]
        lines.append(f"| {names[engine]} | " + " | ".join(counted) + f" | {median} |")
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    readme = ROOT / "README.md"
    before, _, rest = readme.read_text(encoding="utf-8").partition(BEGIN)
    readme.write_text(before + BEGIN + table() + END + rest.partition(END)[2], encoding="utf-8")
