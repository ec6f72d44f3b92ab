"""Command-line options, generated from the declarations of a study; see `carom.support.options`."""

from __future__ import annotations

import dataclasses
import inspect
from collections.abc import Callable
from functools import wraps
from typing import Annotated, Any, Concatenate, ParamSpec, TypeVar, get_type_hints

import typer

from carom.cli.command_line import with_default
from carom.cli.common import guarded
from carom.support.options import DeclaredOptions, Option, declared_options, format_bound

Asked = TypeVar("Asked", bound=DeclaredOptions)
Parameters = ParamSpec("Parameters")


def asking(
    kind: type[Asked],
) -> Callable[[Callable[Concatenate[Asked, Parameters], None]], Callable[..., None]]:
    """Return a decorator that adds a study's declared options to a command, which gets them as its first argument."""

    def decorated(body: Callable[Concatenate[Asked, Parameters], None]) -> Callable[..., None]:
        made = [
            inspect.Parameter(
                name,
                inspect.Parameter.KEYWORD_ONLY,
                default=None,
                annotation=Annotated[_type(one), shown_option(kind, name)],
            )
            for name, one in declared_options(kind).items()
            if one.flags
        ]

        @wraps(body)
        def command(*args: Any, **given: Any) -> None:
            body(kind.said({one.name: given.pop(one.name, None) for one in made}), *args, **given)

        hints = get_type_hints(body, include_extras=True)
        _, *own = inspect.signature(body).parameters.values()
        own = [one.replace(annotation=hints[one.name], kind=inspect.Parameter.KEYWORD_ONLY) for one in own]
        command.__signature__ = inspect.Signature([*own, *made])  # type: ignore[attr-defined] # Typer reads it
        command.__annotations__ = {one.name: one.annotation for one in (*own, *made)}
        return guarded(command)

    return decorated


def shown_option(kind: type[DeclaredOptions], name: str) -> Any:
    """Return a declared option for Typer, with description, default and range."""
    one = declared_options(kind)[name]
    (default,) = (field.default for field in dataclasses.fields(kind) if field.name == name)
    text = with_default(one.what, one.default or _default(one, default), one.kind.range)
    return typer.Option(*one.flags, metavar=one.kind.word or None, help=text)


def _default(one: Option, default: Any) -> str:
    if default is None or default is False or default == ():
        return ""
    if default is True:
        return one.flags[0].partition("/")[0]
    if one.many:
        return ", ".join(default)
    return format_bound(default) if isinstance(default, int | float) else str(default)


def _type(one: Option) -> Any:
    if not one.kind.word:
        return bool | None
    return list[str] | None if one.many or one.kind.gather else str | None
