"""The same functions, compiled: one source runs as plain Python and, where llvmlite is installed, as machine code.

A function and all of Carom's functions that it calls become one *unit*: a C function on numbers and on pointers into
arrays. The originals stay as they are. Contraction and reordering stay off, so both forms give the same bits. What a
unit calls of another unit stays in that other, which several can share. A unit's object file is kept on disk under a
digest of all that went into it (`carom.physics.object_cache`), and a later start only loads it.
"""

from __future__ import annotations

import ctypes
import functools
import hashlib
import importlib.util
import marshal
from dataclasses import dataclass
from pathlib import Path
from types import FunctionType
from typing import TYPE_CHECKING, Any

from carom.physics import machine_code, object_cache

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

__all__ = ["Recipe", "Unit", "addresses", "compiled_unit", "compiler_installed", "is_cached", "prefetch"]


@dataclass(frozen=True)
class Recipe:
    """What a unit is made of.

    Attributes:
        function: The function. Its calls of other functions of Carom become calls of their compiled copies.
        result: Type of its result: "float64" or "int64".
        arguments: Types of its arguments; "float64*" is a pointer into an array. Arrays that are written to must not
            overlap others.
        linked: Units that this one calls, by the names of their functions, instead of compiling their code into itself.
    """

    function: Callable[..., Any]
    result: str
    arguments: tuple[str, ...]
    linked: tuple[Recipe, ...] = ()

    def name(self) -> str:
        """Return the function's name with a digest of the code of the unit, and of those linked to it."""
        digest = hashlib.sha256(_translator())
        digest.update(repr((self.result, self.arguments, [each.name() for each in self.linked])).encode())
        for callee in _callees(self.function, {each.function.__name__ for each in self.linked}, {}):
            digest.update(_identity(callee))
        return f"{self.function.__name__}_{digest.hexdigest()[:16]}"


@dataclass(frozen=True)
class Unit:
    """A compiled function.

    Attributes:
        symbol: What other units call it by.
        address: Where it is.
        ctypes: It, to be called from Python.
    """

    symbol: str
    address: int
    ctypes: Callable[..., Any]


@functools.cache
def compiler_installed() -> bool:
    """Whether llvmlite can be imported; looking does not import it."""
    return importlib.util.find_spec("llvmlite") is not None


def is_cached(recipe: Recipe) -> bool:
    """Whether a unit seems to be on disk, so that it need only be loaded; looking imports nothing."""
    return all(map(is_cached, recipe.linked)) and object_cache.holds(_source(recipe), recipe.name())


@functools.cache
def compiled_unit(recipe: Recipe) -> Unit:
    """Return a unit: from this process, from the disk, or compiled now.

    Raises:
        TranslationError: The function uses a part of Python that cannot be compiled.
    """
    name, linked = recipe.name(), [compiled_unit(each) for each in recipe.linked]
    symbol, key = f"carom_{name}", f"{name} {machine_code.target_name()}"
    emitted = object_cache.read(_source(recipe), name, key)
    if emitted is None:
        emitted = _compiled(recipe, symbol, linked)
        object_cache.write(_source(recipe), name, key, emitted)
    address = machine_code.address_of(symbol, emitted, {unit.symbol: unit.address for unit in linked})
    call = ctypes.CFUNCTYPE(_ctype(recipe.result), *map(_ctype, recipe.arguments))
    return Unit(symbol, address, call(address))


def prefetch(column: Any, place: int) -> None:
    """Ask for the cache line of a place in an array before it is needed; plain Python has no use for that."""


def addresses(*arrays: Any) -> list[Any]:
    """Return pointers to the data of NumPy arrays, as a unit takes them."""
    return [array.ctypes.data_as(_ctype(f"{array.dtype.name}*")) for array in arrays]


def _compiled(recipe: Recipe, symbol: str, linked: list[Unit]) -> bytes:
    from carom.physics.lowering import lowered

    external = {
        each.function.__name__: (unit.symbol, each.result, each.arguments)
        for each, unit in zip(recipe.linked, linked, strict=True)
    }
    functions = list(_callees(recipe.function, set(external), {}))
    return machine_code.object_file(
        symbol, *lowered(functions, symbol, recipe.result, recipe.arguments, external)
    )


def _source(recipe: Recipe) -> str:
    return recipe.function.__code__.co_filename


@functools.cache
def _ctype(name: str) -> Any:
    kind = getattr(ctypes, {"float64": "c_double"}.get(name.rstrip("*"), f"c_{name.rstrip('*')}"))
    return ctypes.POINTER(kind) if name.endswith("*") else kind


def _callees(function: Any, linked: set[str], seen: dict[Any, None]) -> Iterable[Any]:
    """Return a function and those of Carom that it calls, directly or not; without linked ones, each once."""
    seen[function] = None
    for name in function.__code__.co_names:
        called = function.__globals__.get(name)
        ours = isinstance(called, FunctionType) and called.__module__.startswith("carom.")
        if ours and name not in linked and called not in seen:
            _callees(called, linked, seen)
    return seen


def _identity(function: Any) -> bytes:
    """Return what a function's machine code hangs on: byte code, numbers it finds by name, whether it is inlined."""
    code, names = function.__code__, function.__globals__
    numbers = [(name, names[name]) for name in code.co_names if isinstance(names.get(name), int | float)]
    numbers += [(name, names[name]._fields) for name in code.co_names if hasattr(names.get(name), "_fields")]
    inline = function in names.get("INLINE", ())
    return marshal.dumps((code.co_name, code.co_code, repr(code.co_consts), code.co_names, numbers, inline))


@functools.cache
def _translator() -> bytes:
    """Return a digest of the source by which functions become machine code."""
    home = Path(__file__).parent
    files = [home / "machine_code.py", home / "lowering.py"]
    return hashlib.sha256(b"".join(file.read_bytes() for file in files)).digest()
