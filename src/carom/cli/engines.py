"""`carom engines`: list the engines."""

from __future__ import annotations

from carom.cli.shared import guarded, print_document

__all__ = ["engines"]


@guarded
def engines() -> None:
    """List the engines: version, profiles and capabilities, or why one is unavailable."""
    from carom.report.small import engine_document
    from carom.runs.engines import engines as known_engines

    print_document(engine_document(known_engines()))
