"""What keeps `carom.runs` readable in one sitting."""

from __future__ import annotations

import ast
import inspect
from pathlib import Path

import carom
from carom import runs

MOST_LINES = 60
MOST_PARAMETERS = 6


def test_functions_are_short() -> None:
    """No function of `carom.runs` is longer than a reader can hold, and a cross-check takes six parameters at most."""
    long = [
        f"{path.name}: {node.name}"
        for path in Path(runs.__path__[0]).glob("*.py")
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        if isinstance(node, ast.FunctionDef) and (node.end_lineno or 0) - node.lineno >= MOST_LINES
    ]
    assert long == []
    assert len(inspect.signature(carom.cross_check).parameters) <= MOST_PARAMETERS
