"""Extracts time step and step count from an engine's settings code."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator

_COMMENT = re.compile(r"<!--.*?-->\s*", re.DOTALL)


def step_lines(code: str, at_another_step: str) -> str:
    """Return the statements of a program, or the lines of a model, that depend on the time step.

    - Python: statements that set or use `dt` or `steps`, or differ at another step, with the constants that they use.
      The scene's bodies are left out.
    - XML: lines that differ at another step.
    - JavaScript: none, since its world exists only within the written module.

    Args:
        code: Code of a scene, as written by an adapter (`carom.engines.api.CodedAdapter`).
        at_another_step: Code of the same scene at another step.

    Returns:
        The lines as they appear in the code; empty if there are none.
    """
    if code.startswith("<"):
        other = set(_COMMENT.sub("", at_another_step).splitlines())
        return "\n".join(line.strip() for line in _COMMENT.sub("", code).splitlines() if line not in other)
    if not code.startswith("#"):
        return ""
    other = {_source(at_another_step, statement) for statement in ast.parse(at_another_step).body}
    statements = ast.parse(code).body
    own = {one.name for one in statements if isinstance(one, ast.FunctionDef)}
    chosen: list[ast.stmt] = []
    taken: set[str] = set()
    # In reverse order, so that the uses of a name are known at its assignment.
    for statement in reversed(statements):
        if isinstance(statement, ast.FunctionDef) or own & (names := set(_names(statement, ast.Load))):
            continue
        given = set(_names(statement, ast.Store))
        decides = bool((names | given) & {"dt", "steps"}) or _source(code, statement) not in other
        plain = isinstance(statement, ast.Assign) and isinstance(statement.value, ast.Constant)
        if decides or (plain and given & taken):
            chosen.insert(0, statement)
            taken |= names
    return "\n".join(_source(code, statement) for statement in chosen)


def changed_lines(code: str, before: str) -> str:
    """Return the statements of a Python program, or the lines of another text, that differ from an earlier version.

    In a program, also return the statements that use a name that these statements assign. Comments are left out.
    """
    if not code.startswith("#"):
        model = code.startswith("<")
        here, there = (_COMMENT.sub("", text) if model else text for text in (code, before))
        other = set(there.splitlines())
        lines = (line.strip() for line in here.splitlines() if line not in other)
        return "\n".join(line for line in lines if model or not line.startswith("//"))
    other = {_source(before, statement) for statement in ast.parse(before).body}
    statements = ast.parse(code).body
    changed = [one for one in statements if _source(code, one) not in other]
    given = {name for one in changed for name in _names(one, ast.Store)}
    return "\n".join(_source(code, one) for one in statements if one in changed or given & {*_names(one, ast.Load)})


def _source(code: str, statement: ast.stmt) -> str:
    *before, last = code.split("\n")[statement.lineno - 1 : statement.end_lineno]
    return "\n".join([*before, last.encode()[: statement.end_col_offset].decode()])


def _names(statement: ast.stmt, context: type[ast.expr_context]) -> Iterator[str]:
    for node in ast.walk(statement):
        if isinstance(node, ast.Name) and isinstance(node.ctx, context):
            yield node.id
