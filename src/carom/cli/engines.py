"""`carom engines`: list the engines."""

from __future__ import annotations

from carom.cli.common import console, guarded

__all__ = ["engines"]


@guarded
def engines() -> None:
    """List the engines: version, profiles and capabilities, or why one is unavailable."""
    from carom.registry import engines as known_engines
    from carom.report.engine_table import engine_table

    console().print(engine_table(known_engines()))
