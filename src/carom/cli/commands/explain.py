"""`carom explain`: what a word of a report means."""

from __future__ import annotations

from typing import Annotated

import typer

from carom.cli.common import console, guarded, say, say_lines
from carom.support.escaping import visible


@guarded
def explain(
    words: Annotated[
        list[str] | None, typer.Argument(help="A verdict, a grade or a mark, such as missed; all of them by default.")
    ] = None,
) -> None:
    """Explain a verdict or a grade: what a report means by it, and when it says so."""
    from carom.report.glossary import explained, glossary

    if not words:
        entries = list(glossary())
        width = max(len(entry.word) for entry in entries)
        say_lines(f"{entry.word:{width}}  {entry.kind:7}  {entry.sentence}" for entry in entries)
        return
    phrase = " ".join(words)
    for entry in explained(phrase):
        console().print(visible(str(entry)))
    say("Every number behind it: docs/theory/scoring.md.")
