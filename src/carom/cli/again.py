"""The command that makes a result again, for the result to show: read from what the command declares."""

from __future__ import annotations

import shlex
from contextvars import ContextVar
from typing import Any

from typer.core import TyperCommand

#: They continue a run, or print more of it: its result is the same without.
_NO_PART = {"resume", "retry", "verbose"}

_ASKED: ContextVar[str] = ContextVar("asked", default="carom")


def command_line() -> str:
    """Return the command that is being carried out, each option under its first name; ``carom`` from Python."""
    return _ASKED.get()


class Command(TyperCommand):
    """A command that keeps what it was asked."""

    def invoke(self, ctx: Any) -> Any:
        """Carry it out."""
        words = ["carom", ctx.info_name or ""]
        for one in self.params:
            name, source = one.name or "", ctx.get_parameter_source(one.name or "")
            if source is None or source.name != "COMMANDLINE" or name in _NO_PART:
                continue
            value = ctx.params[name]
            if one.param_type_name == "argument":
                words += map(str, value if isinstance(value, list | tuple) else [value])
            elif isinstance(value, bool):
                words.append((one.opts if value else one.secondary_opts)[0])
            else:
                for item in value if isinstance(value, list | tuple) else [value]:
                    words += [one.opts[0], str(item)]
        token = _ASKED.set(shlex.join(words))
        try:
            return super().invoke(ctx)
        finally:
            _ASKED.reset(token)
