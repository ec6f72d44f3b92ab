"""What of an engine's own code says how long a step is and how often it is taken, read off the code of a profile."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator

_COMMENT = re.compile(r"<!--.*?-->\s*", re.DOTALL)


def step_lines(code: str, at_another_step: str) -> str:
    """Return the statements of a program, or the lines of a model, that a step's length decides.

    Of a program in Python these are the statements that say or read how long a step is, or how many there are, and what
    else reads otherwise at another step; with the constants that they take, without the scene's own bodies. Of a
    model in XML they are the lines that read otherwise. Of a module of node there are none: it steps a world of its own
    making, which stands in no other program.

    Args:
        code: What an adapter writes of a scene (`carom.engines.api.CodedAdapter`).
        at_another_step: What it writes of the same at another step.

    Returns:
        The lines, each as it stands in the code; empty where there are none to give.
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
    # From below, so that a name is known to be taken where it is given its value.
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
    """Return the statements of a program in Python, or the lines of another text, that read otherwise than before.

    Of a program also those that read what these give a value to. Comments are left out.
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
