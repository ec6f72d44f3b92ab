"""List the grades that differ between two files of results: `honest_rows.py OLD NEW`, two results.jsonl.

Each file is made by `carom run paper classics gravity spin engines issues -e pic -e pit -e pymunk -e box2d -e mujoco -e
pybullet --no-timing --report FOLDER`, so each scene runs at its own step sizes. The output is Markdown: a table with
the number of rows for each old and new grade, and a table of the rows whose grade became worse, with their verdicts in
the new file. Older formats, which `carom diff` does not read, are also allowed.
"""

from __future__ import annotations

import json
import sys
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any

#: Grades from best to worst; "ungraded" is separate.
WORSENING = ("exact", "close", "sampled", "inaccurate", "diverged", "diverged_inaccurate", "wrong")
UNGRADED = "ungraded"

#: Key of a row: scene, engine, profile and step size.
Key = tuple[str, str, str, float]


def read(path: str) -> dict[Key, dict[str, Any]]:
    """Return the rows of a results.jsonl, without its first line."""
    _, *lines = Path(path).read_text(encoding="utf-8").splitlines()
    rows = map(json.loads, lines)
    return {(row["scene"], row["engine"], row["profile"], row["dt_s"]): row for row in rows}


def word(row: dict[str, Any]) -> str:
    """Return the grade of a row, or its status if the row has no grade."""
    return str(row["grade"] or row["status"])


def said(row: dict[str, Any]) -> str:
    """Return the verdicts of a row, each with its reason."""
    return "; ".join(f"{finding['verdict']} ({finding['reason']})" for finding in row["verdicts"])


def worse(old: str, new: str) -> bool:
    """Return whether a grade became worse. A row that has lost its grade counts as worse."""
    if old in WORSENING and new in WORSENING:
        return WORSENING.index(new) > WORSENING.index(old)
    return old != new and not (old == UNGRADED and new in WORSENING)


def listed(old: dict[Key, dict[str, Any]], new: dict[Key, dict[str, Any]]) -> Iterator[str]:
    """Yield the lines of the two tables. Rows that only one file contains are not compared."""
    both = sorted(old.keys() & new.keys())
    moved = Counter((word(old[key]), word(new[key])) for key in both)
    words = [w for w in (*WORSENING, UNGRADED) if any(w in pair for pair in moved)]
    yield f"| then, now: | {' | '.join(words)} |"
    yield f"| --- |{' --- |' * len(words)}"
    for was in words:
        yield f"| {was} | {' | '.join(str(moved[was, now] or '') for now in words)} |"
    yield ""
    yield "| scene | method | step, s | then | now | said now |"
    yield "| --- | --- | --- | --- | --- | --- |"
    for key in both:
        scene, engine, profile, dt_s = key
        was, now = word(old[key]), word(new[key])
        if worse(was, now):
            yield f"| {scene} | {engine} {profile} | {dt_s:.4g} | {was} | {now} | {said(new[key])} |"
    yield ""
    yield f"{len(both)} rows; in one of the runs only: {len(old.keys() ^ new.keys())}."


if __name__ == "__main__":
    old_path, new_path = sys.argv[1:]
    sys.stdout.write("\n".join(listed(read(old_path), read(new_path))) + "\n")
