"""No two public classes have one name."""

from __future__ import annotations

import ast
from collections import defaultdict
from pathlib import Path

import carom

SOURCE = Path(carom.__file__).parent


def test_no_two_public_classes_have_one_name() -> None:
    """A class that a reader looks for by its name is found in one module."""
    found = defaultdict(list)
    for path in SOURCE.rglob("*.py"):
        for node in ast.parse(path.read_text(encoding="utf-8")).body:
            if isinstance(node, ast.ClassDef) and not node.name.startswith("_"):
                found[node.name].append(str(path.relative_to(SOURCE)))
    assert len(found) > 100
    assert {name: places for name, places in found.items() if len(places) > 1} == {}
