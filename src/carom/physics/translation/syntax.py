"""The syntax of a function that runs, from the file it was read from."""

from __future__ import annotations

import ast
import functools
import types
from pathlib import Path
from typing import Any

from carom.physics.translation.values import TranslationError

__all__ = ["syntax_of"]


def syntax_of(function: Any) -> ast.FunctionDef:
    """Return the syntax of a function, from the file it was read from."""
    code = function.__code__
    tree, compiled = _module_syntax(code.co_filename)
    first = code.co_firstlineno, code.co_name
    # A file changed since it was imported holds another function than the one that runs.
    if first in tree and first in compiled and _same(compiled[first], code):
        return tree[first]
    raise TranslationError(
        f"{code.co_filename}:{code.co_firstlineno}: the source of {code.co_name} is not what is running: "
        "start Python anew"
    )


def _same(one: types.CodeType, other: types.CodeType) -> bool:
    return (one.co_code, repr(one.co_consts), one.co_names) == (other.co_code, repr(other.co_consts), other.co_names)


@functools.cache
def _module_syntax(path: str) -> tuple[dict[tuple[int, str], ast.FunctionDef], dict[tuple[int, str], types.CodeType]]:
    """Return syntax and byte code of the functions of a file, by first line and name."""
    try:
        tree = ast.parse(Path(path).read_bytes(), path)
    except (OSError, SyntaxError) as error:
        raise TranslationError(f"{path}: compiling needs the source: {error}") from None
    codes = (each for each in compile(tree, path, "exec").co_consts if isinstance(each, types.CodeType))
    functions = (node for node in tree.body if isinstance(node, ast.FunctionDef))
    return (
        {(min([node.lineno, *(d.lineno for d in node.decorator_list)]), node.name): node for node in functions},
        {(each.co_firstlineno, each.co_name): each for each in codes},
    )
