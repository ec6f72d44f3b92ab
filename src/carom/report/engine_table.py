"""The table of `carom engines`."""

from __future__ import annotations

from collections.abc import Sequence

from carom.adapter import Capabilities
from carom.registry import EngineInfo
from carom.report.document import Cell, Column, Document, Section, Table

__all__ = ["engine_document"]


def engine_document(infos: Sequence[EngineInfo]) -> Document:
    """Return a table of engines: version, or why unavailable, profiles and capabilities."""
    heads = ("name", "engine", "version, or why it is unavailable", "profiles", "capabilities")
    rows = tuple(
        (
            info.name,
            info.engine,
            info.version if info.available else Cell(f"unavailable: {info.unavailable}", style="red"),
            ", ".join(info.profiles),
            _capabilities(info.capabilities) if info.capabilities else "",
        )
        for info in infos
    )
    return Document("Carom: engines", (), (Section("Engines", (Table(tuple(map(Column, heads)), rows),)),))


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
