"""Dataclasses that cost little to define.

`dataclasses.dataclass` compiles six methods for each frozen class. For the classes that one command imports, this took
a third of the command's processor time. Here only `__init__` is compiled, and only at the first instance.
"""

from __future__ import annotations

import dataclasses
import operator
from reprlib import recursive_repr
from typing import TYPE_CHECKING, Any, NoReturn

__all__ = ["dataclass"]

if TYPE_CHECKING:
    from collections.abc import Callable
    from dataclasses import dataclass
else:

    def dataclass(cls=None, /, *, frozen=False, repr=True, eq=True, order=False, kw_only=False):  # noqa: A002
        """Make a class a dataclass, as `dataclasses.dataclass` does with these options."""

        def make(cls):
            cls.__doc__ = cls.__doc__ or cls.__name__  # `dataclasses` would compile a signature for it
            dataclasses.dataclass(init=False, repr=False, eq=False, kw_only=kw_only)(cls)
            methods = {"__init__": _Init(cls)}
            if frozen:
                methods |= {"__setattr__": _refuse_setting, "__delattr__": _refuse_deleting}
            if repr:
                methods["__repr__"] = _show
            if eq:
                key = _key([field.name for field in dataclasses.fields(cls) if field.compare])
                names = ("eq", "lt", "le", "gt", "ge") if order else ("eq",)
                methods |= {f"__{name}__": _comparison(getattr(operator, name), key) for name in names}
                methods["__hash__"] = (lambda self: hash(key(self))) if frozen else None
            for name, method in methods.items():
                if name not in vars(cls):
                    setattr(cls, name, method)
            return cls

        return make if cls is None else make(cls)


class _Init:
    """Placeholder for the method `__init__` of a class. The first lookup compiles the method and puts it in place."""

    def __init__(self, cls: type[Any]) -> None:
        self._cls = cls

    def __get__(self, instance: object, owner: type[Any]) -> Any:
        self._cls.__init__ = _compile_init(self._cls)
        return self._cls.__init__.__get__(instance, owner)


def _compile_init(cls: type[Any]) -> Callable[..., None]:
    """Return a method that sets all fields of a dataclass and then calls `__post_init__`, if there is one."""
    fields = dataclasses.fields(cls)
    scope: dict[str, Any] = {"_set": object.__setattr__, "_UNSET": dataclasses.MISSING}
    parameters: list[str] = []
    named: list[str] = []
    body: list[str] = []
    for field in fields:
        name, default, value = field.name, "", field.name
        if field.default is not dataclasses.MISSING:
            scope[f"_{name}_default"] = field.default
            default = f"=_{name}_default"
        elif field.default_factory is not dataclasses.MISSING:
            scope[f"_{name}_factory"] = field.default_factory
            default, value = "=_UNSET", f"_{name}_factory() if {name} is _UNSET else {name}"
        (named if field.kw_only else parameters).append(name + default)
        body.append(f" _set(_self, {name!r}, {value})")
    if hasattr(cls, "__post_init__"):
        body.append(" _self.__post_init__()")
    signature = ", ".join(("_self", *parameters, *(("*", *named) if named else ())))
    exec(f"def __init__({signature}):\n" + "\n".join(body or [" pass"]), scope)  # noqa: S102 - text made of field names
    init: Callable[..., None] = scope["__init__"]
    init.__qualname__, init.__module__ = f"{cls.__qualname__}.__init__", cls.__module__
    init.__annotations__ = {field.name: field.type for field in fields} | {"return": None}
    return init


def _key(names: list[str]) -> Callable[[Any], Any]:
    """Return a function that returns the values of these fields as a tuple."""
    if len(names) > 1:
        return operator.attrgetter(*names)
    return lambda instance: tuple(getattr(instance, name) for name in names)


def _comparison(compare: Callable[[Any, Any], Any], key: Callable[[Any], Any]) -> Callable[[Any, object], Any]:
    def method(self: Any, other: object) -> Any:
        if other.__class__ is not self.__class__:
            return NotImplemented
        return compare(key(self), key(other))

    return method


@recursive_repr()
def _show(self: Any) -> str:
    shown = (f"{field.name}={getattr(self, field.name)!r}" for field in dataclasses.fields(self) if field.repr)
    return f"{self.__class__.__qualname__}({', '.join(shown)})"


def _refuse_setting(_self: object, name: str, _value: object) -> NoReturn:
    raise dataclasses.FrozenInstanceError(f"cannot assign to field {name!r}")


def _refuse_deleting(_self: object, name: str) -> NoReturn:
    raise dataclasses.FrozenInstanceError(f"cannot delete field {name!r}")
