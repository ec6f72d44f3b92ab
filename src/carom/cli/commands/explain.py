"""`carom explain`: explain a word of the reports."""

from __future__ import annotations

from typing import Annotated

import typer

from carom.cli.output import build_console, print_lines, print_text
from carom.support.escaping import escape_controls


def explain(
    words: Annotated[
        list[str] | None, typer.Argument(help="Verdict, grade or mark, such as missed (default: all).")
    ] = None,
) -> None:
    """Explain a verdict, grade or mark that reports use."""
    from carom.report.glossary import find_meanings, list_meanings

    if not words:
        entries = list(list_meanings())
        width = max(len(entry.word) for entry in entries)
        print_lines(f"{entry.word:{width}}  {entry.kind:7}  {entry.sentence}" for entry in entries)
        return
    for entry in find_meanings(" ".join(words)):
        build_console().print(escape_controls(str(entry)))
    print_text("All formulas: docs/theory/scoring.md.")
