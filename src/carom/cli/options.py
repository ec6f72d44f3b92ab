"""A command's options, made from what its study declares: see `carom.support.options`."""

from __future__ import annotations

import dataclasses
import inspect
from collections.abc import Callable
from enum import Enum
from functools import wraps
from typing import Annotated, Any, Concatenate, ParamSpec, TypeVar, get_type_hints

import typer

from carom.cli.common import guarded
from carom.support.options import DeclaredOptions, Option, declared

Asked = TypeVar("Asked", bound=DeclaredOptions)
Parameters = ParamSpec("Parameters")

#: What these take, their word and the sentence before it say.
_PLAIN = {"", "NAME", "ANGLE", "NAME=VALUE", "OLD=NEW"}


def asking(
    kind: type[Asked],
) -> Callable[[Callable[Concatenate[Asked, Parameters], None]], Callable[..., None]]:
    """Give a command the options that its study declares; its body's first argument is what they come to."""

    def decorated(body: Callable[Concatenate[Asked, Parameters], None]) -> Callable[..., None]:
        made = [
            inspect.Parameter(
                name,
                inspect.Parameter.KEYWORD_ONLY,
                default=None,
                annotation=Annotated[_type(one), shown_option(kind, name)],
            )
            for name, one in declared(kind).items()
            if one.flags
        ]

        @wraps(body)
        def command(*args: Any, **given: Any) -> None:
            body(kind.said({one.name: given.pop(one.name, None) for one in made}), *args, **given)

        hints = get_type_hints(body, include_extras=True)
        _, *own = inspect.signature(body).parameters.values()
        own = [one.replace(annotation=hints[one.name], kind=inspect.Parameter.KEYWORD_ONLY) for one in own]
        command.__signature__ = inspect.Signature([*own, *made])  # type: ignore[attr-defined] # what Typer looks at
        command.__annotations__ = {one.name: one.annotation for one in (*own, *made)}
        return guarded(command)

    return decorated


def shown_option(kind: type[DeclaredOptions], name: str) -> Any:
    """Return an option as `--help` shows it: what it is, its bounds, and its default."""
    one = declared(kind)[name]
    (default,) = (field.default for field in dataclasses.fields(kind) if field.name == name)
    said = one.default or _default(one, default)
    measured = one.kind.word not in _PLAIN and not isinstance(default, Enum)
    bounds = f"{one.kind.said[0].upper()}{one.kind.said[1:]}" if measured else ""
    more = "; ".join(part for part in (bounds, f"{said} by default" if said else "") if part)
    what = f"{one.what} {more[0].upper()}{more[1:]}." if more else one.what
    return typer.Option(*one.flags, metavar=one.kind.word or None, help=what)


def _default(one: Option, default: Any) -> str:
    if default is None or default is False or default == ():
        return ""
    if default is True:
        return one.flags[0].partition("/")[0]
    if one.many:
        return " and ".join(map(repr, default))
    return f"{default:g}" if isinstance(default, float) else str(default)


def _type(one: Option) -> Any:
    if not one.kind.word:
        return bool | None
    return list[str] | None if one.many or one.kind.gather else str | None
