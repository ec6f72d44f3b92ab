"""How large a function of a study or a command may be."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest

import carom

SOURCE = Path(carom.__file__).parent

#: A screen of lines, and as many arguments as a reader keeps apart; options made from a declaration are one.
MOST_LINES, MOST_PARAMETERS = 80, 12


def parameters(function: ast.FunctionDef | ast.AsyncFunctionDef) -> int:
    asked = function.args
    named = len(asked.posonlyargs) + len(asked.args) + len(asked.kwonlyargs)
    return named + (asked.vararg is not None) + (asked.kwarg is not None)


@pytest.mark.parametrize("room", ["cli", "studies"])
def test_functions_are_of_a_size_that_is_read(room: str) -> None:
    """No function of a room is longer than a screen, or takes more than a dozen arguments."""
    functions = {
        f"{path.relative_to(SOURCE)}:{node.lineno} {node.name}": node
        for path in (SOURCE / room).rglob("*.py")
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef)
    }
    assert len(functions) > 50
    long = {name for name, node in functions.items() if (node.end_lineno or 0) - node.lineno >= MOST_LINES}
    many = {name for name, node in functions.items() if parameters(node) > MOST_PARAMETERS}
    assert (long, many) == (set(), set())
