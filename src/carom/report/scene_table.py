"""The table and the full text of `carom scenes`."""

from __future__ import annotations

from collections.abc import Sequence

import tomli_w
from rich.table import Table
from rich.text import Text

from carom.scenes import CatalogueScene, Complaint

__all__ = ["scene_table", "scene_text"]


def scene_table(entries: Sequence[CatalogueScene]) -> Table:
    """Return a table of scenes: name, size, and what each shows."""
    table = Table(title="Scenes", title_justify="left")
    table.add_column("name", no_wrap=True)
    for heading in ("discs", "walls", "impacts"):
        table.add_column(heading, justify="right")
    table.add_column("what it shows")
    for entry in entries:
        scene, count = entry.scene, entry.known.count
        impacts = "" if count is None else str(count)
        row = (entry.name, str(len(scene.discs)), str(len(scene.walls)), impacts, entry.shows)
        table.add_row(*(Text(cell) for cell in row))
    return table


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
