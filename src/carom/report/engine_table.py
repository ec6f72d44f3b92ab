"""The table of `carom engines`."""

from __future__ import annotations

from collections.abc import Sequence

from rich.table import Table
from rich.text import Text

from carom.adapter import Capabilities
from carom.registry import EngineInfo

__all__ = ["engine_table"]


def engine_table(infos: Sequence[EngineInfo]) -> Table:
    """Return a table of engines: version, or why unavailable, profiles and capabilities."""
    table = Table(title="Engines", title_justify="left")
    for heading in ("name", "engine", "version, or why it is unavailable", "profiles", "capabilities"):
        table.add_column(heading)
    for info in infos:
        state = Text(info.version) if info.available else Text(f"unavailable: {info.unavailable}", style="red")
        able = _capabilities(info.capabilities) if info.capabilities else ""
        table.add_row(Text(info.name), Text(info.engine), state, Text(", ".join(info.profiles)), Text(able))
    return table


def _capabilities(able: Capabilities) -> str:
    low, high = able.restitution
    parts = [
        "walls" if able.walls else "no walls",
        "immovable discs" if able.immovable_discs else "no immovable discs",
        "gravity" if able.gravity else "no gravity yet",
        f"restitution {low:g}" if low == high else f"restitution {low:g} to {high:g}",
        *(["continuous detection"] if able.continuous_detection else []),
        f"contact times {able.contact_times.value}",
        f"float{able.float_bits}",
    ]
    return ", ".join(parts)
