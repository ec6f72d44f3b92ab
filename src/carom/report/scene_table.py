"""The table and the full text of `carom scenes`."""

from __future__ import annotations

from collections.abc import Sequence

import tomli_w

from carom.report.document import Document, Section, Table
from carom.scenes import CatalogueScene, Complaint

__all__ = ["scene_document", "scene_text"]


def scene_document(entries: Sequence[CatalogueScene]) -> Document:
    """Return a table of scenes: name, size, and what each shows."""
    rows = (
        (
            entry.name,
            entry.shows,
            str(len(entry.scene.discs)),
            str(len(entry.scene.walls)),
            "" if entry.known.count is None else str(entry.known.count),
        )
        for entry in entries
    )
    table = Table.of("Scenes", ("name", "what it shows", "discs", "walls", "impacts"), rows)
    return Document("Carom: scenes", (), (Section("Scenes", (table,)),))


def scene_text(entry: CatalogueScene) -> str:
    """Return a scene as a TOML file that can be loaded again, its known answer told in comments at the top."""
    lines = [entry.shows, f"Known answer: {entry.known.source}"]
    if entry.known.count is not None:
        lines.append(f"Impacts: {entry.known.count}")
    if entry.known.convention:
        lines.append(f"No unique answer: {entry.known.convention}")
    if isinstance(entry, Complaint):
        lines += [f"Reported of {entry.about}: {entry.reported}", f"Thread: {entry.thread}", entry.made]
    comments = "".join(f"# {line}\n" for line in lines)
    return comments + tomli_w.dumps(entry.scene.model_dump(mode="python"))
