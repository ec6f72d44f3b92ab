"""Reads the records of a cross-check as plain JSON objects. Tables of documents are built from these records."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any


def read_raw_records(path: Path) -> tuple[dict[str, Any], list[dict[str, Any]]]:
    """Return the first line of a results.jsonl and its rows. The fields are not validated."""
    head, *rows = map(json.loads, path.read_bytes().splitlines())
    return head, rows
