"""Writes the tables of `docs/results/stress.md`; `make stress` runs the full stress campaign and then this script.

The tables are copied from `stress.md`, which `carom stress --out` writes.
"""

from __future__ import annotations

import re
import sys
from pathlib import Path

from carom.studies.stress.document import WORDS

PAGE = Path(__file__).resolve().parents[1] / "results" / "stress.md"

#: The headings of the first columns, which identify the tables.
KINDS = tuple(WORDS.values())
#: Cell of the campaign's page. The last part, which is left out here, is the error at the last value that passed.
_BEHIND = re.compile(r"(= to \S+|~ \S+|x seen|= not seen) \S+")
_PART = re.compile(r"(<!-- made by docs/figures/stress_tables\.py: ([\w ]+) -->\n)((?s:.*?))(<!-- end -->)")


def table(text: str, kind: str) -> str:
    """Return the table of one kind of tests from a campaign's `stress.md`, without axes and errors.

    Raises:
        ValueError: There is no such table.
    """
    found = re.search(rf"^\| {kind} \|.*\n(?:\|.*\n)+", text, re.MULTILINE)
    if found is None:
        raise ValueError(f"the campaign has no table of {kind}s: run the full campaign")
    return "".join(map(_narrow, found[0].splitlines()))


def _narrow(row: str) -> str:
    name, _, *cells = (cell.strip() for cell in row.split("|")[1:-1])
    return "| " + " | ".join([name, *(_BEHIND.sub(r"\1", cell) for cell in cells)]) + " |\n"


def filled(page: str, campaign: str) -> str:
    """Return the page with the tables of a campaign."""
    return _PART.sub(lambda found: f"{found[1]}{table(campaign, found[2])}{found[4]}", page)


def kept(page: str) -> dict[str, list[list[str]]]:
    """Return the tables of a page, each as a list of rows. The first row contains the headings."""
    return {
        found[2]: [[cell.strip() for cell in line.split("|")[1:-1]] for line in found[3].splitlines() if line != ""]
        for found in _PART.finditer(page)
    }


if __name__ == "__main__":
    PAGE.write_text(
        filled(PAGE.read_text(encoding="utf-8"), Path(sys.argv[1]).read_text(encoding="utf-8")), encoding="utf-8"
    )
