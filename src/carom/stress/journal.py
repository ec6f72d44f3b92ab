"""The journal of a campaign: one line of JSON a finished cell, from which an interrupted campaign is taken up again."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from carom.errors import InputError
from carom.runs.journal import LineFile
from carom.stress.results import Spot

__all__ = ["Journal"]

FORMAT = 1


class Journal(LineFile):
    """Cells as they finish, one by one; the same rules as for `carom.runs.journal.LineFile`.

    The first line says which campaign it is of.

    Args:
        path: The file.
        stamp: What a campaign must share with the one that it takes up: versions and form.
        resume: Whether to go on with what is there; a journal that holds anything is refused otherwise.

    Attributes:
        spots: The cells that are finished, by kind, line and method.

    Raises:
        InputError: The file holds something and `resume` is not set, its journal is of another campaign, or another
            process writes to it.
    """

    def __init__(self, path: Path, stamp: Mapping[str, Any], *, resume: bool) -> None:
        super().__init__(path, resume=resume)
        try:
            self.spots: dict[tuple[str, str, str], Spot] = {}
            head = json.dumps({"format": FORMAT, **stamp}, sort_keys=True)
            lines = self.found.splitlines()
            if not lines:
                self.append([head])
            elif lines[0] != head.encode():
                there = lines[0][:200].decode(errors="replace")
                raise InputError(
                    f"{path} is of another campaign ({there}), this one is {head}: "
                    "leave out --resume and choose another --out"
                )
            for line in lines[1:]:
                try:
                    spot = Spot.from_json(json.loads(line))
                except (ValueError, KeyError, TypeError):  # not a cell: it is done over
                    continue
                self.spots[spot.kind, spot.line, spot.method] = spot
        except BaseException:
            self.close()
            raise

    def add(self, spot: Spot) -> None:
        """Write down a finished cell."""
        self.append([json.dumps(spot.as_json())])
        self.spots[spot.kind, spot.line, spot.method] = spot
