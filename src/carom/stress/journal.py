"""The journal of a campaign: one line of JSON a finished cell, from which an interrupted campaign is taken up again."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from types import TracebackType
from typing import Any, Self, TextIO

from carom.errors import InputError
from carom.stress.results import Spot

__all__ = ["Journal"]

FORMAT = 1


class Journal:
    """Cells as they finish, appended and flushed one by one. A line torn by an interruption is done over.

    Attributes:
        spots: The cells that are finished, by kind, line and method.
    """

    def __init__(self, path: Path, stamp: Mapping[str, Any], *, resume: bool) -> None:
        """Open a journal.

        Args:
            path: The file.
            stamp: What a campaign must share with the one that it takes up: versions and form.
            resume: Whether to go on with what is there; else a new journal is begun.

        Raises:
            InputError: The journal there is of another campaign.
        """
        self.spots: dict[tuple[str, str, str], Spot] = {}
        head = json.dumps({"format": FORMAT, **stamp}, sort_keys=True)
        lines = path.read_text(encoding="utf-8").split("\n") if resume and path.exists() else []
        # Whole lines end in a newline: what comes after the last one is torn.
        whole = lines[:-1]
        if whole and whole[0] != head:
            raise InputError(
                f"{path} is of another campaign ({whole[0][:200]}), this one is {head}: "
                "leave out --resume to begin anew, or choose another --out"
            )
        for line in whole[1:]:
            try:
                spot = Spot.from_json(json.loads(line))
            except (ValueError, KeyError, TypeError):  # not a cell: it is done over
                continue
            self.spots[spot.kind, spot.line, spot.method] = spot
        path.parent.mkdir(parents=True, exist_ok=True)
        kept = "".join(f"{line}\n" for line in (head, *(json.dumps(spot.as_json()) for spot in self.spots.values())))
        part = path.with_name(f".{path.name}.part")
        part.write_text(kept, encoding="utf-8")
        part.replace(path)
        self._file: TextIO = path.open("a", encoding="utf-8")

    def add(self, spot: Spot) -> None:
        """Write down a finished cell."""
        self.spots[spot.kind, spot.line, spot.method] = spot
        self._file.write(f"{json.dumps(spot.as_json())}\n")
        self._file.flush()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._file.close()
