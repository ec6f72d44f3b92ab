"""Command-line options, built from the declared options of a study; see `carom.support.options`."""

from __future__ import annotations

import dataclasses
import inspect
from collections.abc import Callable
from functools import wraps
from typing import Annotated, Any, Concatenate, ParamSpec, TypeVar, get_type_hints

import typer

from carom.cli.command_line import insert_default
from carom.support.options import DeclaredOptions, Option, format_bound, list_declared_options

Kind = TypeVar("Kind", bound=DeclaredOptions)
Parameters = ParamSpec("Parameters")


def add_options(kind: type[Kind]) -> Callable[[Callable[Concatenate[Kind, Parameters], None]], Callable[..., None]]:
    """Return a decorator that adds a study's options to a command.

    The decorator passes the values of the options as the command's first argument.
    """

    def decorate(body: Callable[Concatenate[Kind, Parameters], None]) -> Callable[..., None]:
        declared_options = [
            inspect.Parameter(
                name,
                inspect.Parameter.KEYWORD_ONLY,
                default=None,
                annotation=Annotated[_type_of(option), build_typer_option(kind, name)],
            )
            for name, option in list_declared_options(kind).items()
            if option.flags
        ]
        declared_names = [parameter.name for parameter in declared_options]

        @wraps(body)
        def run_command(*args: Any, **given: Any) -> None:
            body(kind.parse_command_line({name: given.pop(name, None) for name in declared_names}), *args, **given)

        hints = get_type_hints(body, include_extras=True)
        _, *own_parameters = inspect.signature(body).parameters.values()
        parameters = [
            *(one.replace(annotation=hints[one.name], kind=inspect.Parameter.KEYWORD_ONLY) for one in own_parameters),
            *declared_options,
        ]
        run_command.__signature__ = inspect.Signature(parameters)  # type: ignore[attr-defined] # Typer reads it
        run_command.__annotations__ = {parameter.name: parameter.annotation for parameter in parameters}
        return run_command

    return decorate


def build_typer_option(kind: type[DeclaredOptions], name: str) -> Any:
    """Return a declared option in Typer's form, with description, default and range."""
    option = list_declared_options(kind)[name]
    (default,) = (field.default for field in dataclasses.fields(kind) if field.name == name)
    text = insert_default(option.what, option.default or _format_default(option, default), option.kind.range)
    return typer.Option(*option.flags, metavar=option.kind.word or None, help=text)


def _format_default(option: Option, default: Any) -> str:
    if default is None or default is False or default == ():
        return ""
    if default is True:
        return option.flags[0].partition("/")[0]
    if option.many:
        return ", ".join(default)
    return format_bound(default) if isinstance(default, int | float) else str(default)


def _type_of(option: Option) -> Any:
    if not option.kind.word:
        return bool | None
    return list[str] | None if option.many or option.kind.gather else str | None
