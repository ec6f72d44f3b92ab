"""Tables of verdicts and grades of `docs/theory/scoring.md`: `python docs/figures/scoring_tables.py` writes them."""

from __future__ import annotations

import re
from pathlib import Path

from carom.comparator.explanations import GRADE_CONDITIONS, VERDICT_CONDITIONS
from carom.report.outcome_marks import Mark

PAGE = Path(__file__).resolve().parents[1] / "theory" / "scoring.md"
_BLOCK = re.compile(r"(<!-- made by docs/figures/scoring_tables\.py: (\w+) -->\n)(?s:.*?)(<!-- end -->)")


def table(name: str) -> str:
    """Return a table in Markdown, `verdicts` or `grades`."""
    rows = {
        "verdicts": [("verdict", "when"), *((verdict.value, when) for verdict, when in VERDICT_CONDITIONS.items())],
        "grades": [("grade", "when"), *((Mark[grade.name].word, when) for grade, when in GRADE_CONDITIONS.items())],
    }[name]
    lines = [f"| {word} | {when} |\n" for word, when in rows]
    return "".join([lines[0], "| --- | --- |\n", *lines[1:]])


def filled(page: str) -> str:
    """Return the page with both tables."""
    return _BLOCK.sub(lambda found: found[1] + table(found[2]) + found[3], page)


if __name__ == "__main__":
    PAGE.write_text(filled(PAGE.read_text(encoding="utf-8")), encoding="utf-8")
