"""Command-line options, built from the declared options of a study; see `carom.support.options`."""

from __future__ import annotations

import dataclasses
import inspect
from collections.abc import Callable
from functools import wraps
from typing import Annotated, Any, Concatenate, ParamSpec, TypeVar, get_type_hints

import typer

from carom.cli.command_line import insert_default
from carom.cli.error_handling import handle_errors
from carom.support.options import DeclaredOptions, Option, format_bound, list_declared_options

Asked = TypeVar("Asked", bound=DeclaredOptions)
Parameters = ParamSpec("Parameters")


def add_options(kind: type[Asked]) -> Callable[[Callable[Concatenate[Asked, Parameters], None]], Callable[..., None]]:
    """Return a decorator for a command: it adds a study's declared options. The command gets them as first argument."""

    def decorate(body: Callable[Concatenate[Asked, Parameters], None]) -> Callable[..., None]:
        declared_options = [
            inspect.Parameter(
                name,
                inspect.Parameter.KEYWORD_ONLY,
                default=None,
                annotation=Annotated[_type_of(one), build_typer_option(kind, name)],
            )
            for name, one in list_declared_options(kind).items()
            if one.flags
        ]

        @wraps(body)
        def run_command(*args: Any, **given: Any) -> None:
            body(
                kind.parse_command_line({one.name: given.pop(one.name, None) for one in declared_options}),
                *args,
                **given,
            )

        hints = get_type_hints(body, include_extras=True)
        _, *own_parameters = inspect.signature(body).parameters.values()
        own_parameters = [
            one.replace(annotation=hints[one.name], kind=inspect.Parameter.KEYWORD_ONLY) for one in own_parameters
        ]
        run_command.__signature__ = inspect.Signature([*own_parameters, *declared_options])  # type: ignore[attr-defined] # Typer reads it
        run_command.__annotations__ = {one.name: one.annotation for one in (*own_parameters, *declared_options)}
        return handle_errors(run_command)

    return decorate


def build_typer_option(kind: type[DeclaredOptions], name: str) -> Any:
    """Return a declared option in Typer's form, with description, default and range."""
    one = list_declared_options(kind)[name]
    (default,) = (field.default for field in dataclasses.fields(kind) if field.name == name)
    text = insert_default(one.what, one.default or _format_default(one, default), one.kind.range)
    return typer.Option(*one.flags, metavar=one.kind.word or None, help=text)


def _format_default(one: Option, default: Any) -> str:
    if default is None or default is False or default == ():
        return ""
    if default is True:
        return one.flags[0].partition("/")[0]
    if one.many:
        return ", ".join(default)
    return format_bound(default) if isinstance(default, int | float) else str(default)


def _type_of(one: Option) -> Any:
    if not one.kind.word:
        return bool | None
    return list[str] | None if one.many or one.kind.gather else str | None
