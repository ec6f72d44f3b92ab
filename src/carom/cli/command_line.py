"""Runs commands: records the command line for results, and formats types and defaults of options for ``--help``."""

from __future__ import annotations

import shlex
from collections.abc import Callable
from contextvars import ContextVar
from functools import partial
from typing import Any

import typer
from typer.core import TyperCommand

from carom.cli.error_handling import handle_errors

#: Options that are not recorded, because they only continue a run or print more.
_NO_PART = {"resume", "retry", "verbose"}

#: Words that ``--help`` shows for Typer's types. `carom.support.options` uses the same words.
_WORDS = {"str": "TEXT", "path": "PATH", "float": "NUMBER", "int": "INTEGER", "int range": "INTEGER"}

_COMMAND_LINE: ContextVar[str] = ContextVar("command_line", default="carom")


def get_command_line() -> str:
    """Return the command line of this run, or ``carom`` if no command is running.

    Options are written with their long names.
    """
    return _COMMAND_LINE.get()


def _format_type(typed: Callable[..., str], argument: bool, ctx: Any) -> str:
    """Return the type of an option for ``--help``: a word such as ``NUMBER``, or the choices."""
    type_name = typed(ctx=ctx).strip("<>").removeprefix("list[").removesuffix("]")
    return "" if argument and "|" not in type_name else _WORDS.get(type_name, type_name)


def insert_default(text: str, default: str, span: str = "") -> str:
    """Insert an option's default and range at the end of the first sentence of the help text."""
    facts = "; ".join(filter(None, (default and f"default: {default}", span)))
    if not facts:
        return text
    first, dot, rest = text.partition(". ")
    return f"{first} ({facts}). {rest}" if dot else f"{text.removesuffix('.')} ({facts})."


class Command(TyperCommand):
    """A command that stores its command line, and shows types in ``--help`` as plain words."""

    def __init__(self, *args: Any, **options: Any) -> None:
        super().__init__(*args, **options)
        for one in self.params:
            if typed := getattr(one, "display_type", None):  # older versions of Typer have no `display_type`
                one.display_type = partial(_format_type, typed, one.param_type_name == "argument")  # type: ignore[attr-defined] # see above

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Parse the command line. Remove Typer's prefix "Value error" from error messages."""
        try:
            return super().parse_args(ctx, args)
        except typer.BadParameter as error:
            error.message = error.message.removeprefix("Value error, ")
            raise

    def invoke(self, ctx: Any) -> Any:
        """Run the command, and handle its errors."""
        words = ["carom", ctx.info_name or ""]
        for parameter in self.params:
            name, source = parameter.name or "", ctx.get_parameter_source(parameter.name or "")
            if source is None or source.name != "COMMANDLINE" or name in _NO_PART:
                continue
            value = ctx.params[name]
            if parameter.param_type_name == "argument":
                words += map(str, value if isinstance(value, list | tuple) else [value])
            elif isinstance(value, bool):
                words.append((parameter.opts if value else parameter.secondary_opts)[0])
            else:
                for item in value if isinstance(value, list | tuple) else [value]:
                    words += [parameter.opts[0], str(item)]
        token = _COMMAND_LINE.set(shlex.join(words))
        try:
            with handle_errors():
                return super().invoke(ctx)
        finally:
            _COMMAND_LINE.reset(token)
