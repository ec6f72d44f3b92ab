"""Lines of a journal, independent of the order in which jobs finished."""

from __future__ import annotations

import json
from contextlib import suppress
from pathlib import Path


def read_canonical_lines(path: Path) -> list[bytes]:
    """Return the different lines of a journal, sorted, without a torn last line."""
    *lines, end = path.read_bytes().removesuffix(b"\n").split(b"\n")
    with suppress(ValueError):
        json.loads(end)
        lines.append(end)
    return sorted({*lines})
