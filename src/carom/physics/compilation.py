"""The same functions, compiled: one source runs as plain Python and, where numba is installed, as machine code.

A function and all of Carom's functions that it calls become one *unit*: a C function on numbers and on pointers into
arrays. The originals stay as they are. Contraction and reordering stay off (`fastmath=False`; LLVM fuses no multiply
and add without leave), so both forms give the same bits. What a unit calls of another unit stays in that other: a
compiler works on a function together with all that it calls, so units keep the first start short. Numba caches a unit
on disk, beside the source or in the user's cache directory, under a digest of all the code that went into it.
"""

from __future__ import annotations

import functools
import hashlib
import importlib.util
import marshal
import sys
from collections.abc import Callable, Iterator
from types import FunctionType
from typing import Any

__all__ = ["Unit", "addresses", "compiled_unit", "numba_installed", "prefetch"]

Unit = Any  # numba's CFunc: `ctypes` calls it from Python, `address` is what other units call


@functools.cache
def numba_installed() -> bool:
    """Whether numba can be imported; looking does not import it."""
    return importlib.util.find_spec("numba") is not None


@functools.cache
def compiled_unit(
    function: Callable[..., Any], result: str, arguments: tuple[str, ...], linked: tuple[Unit, ...] = ()
) -> Unit:
    """Return a function, with all of Carom's that it calls, compiled.

    Args:
        function: The function. Its calls of other functions of Carom become calls of their compiled copies.
        result: Type of its result: "float64", "int64" or so.
        arguments: Types of its arguments; "float64*" is a pointer into an array.
        linked: Units that this one calls instead of compiling their code into itself.
    """
    import llvmlite.binding as llvm  # type: ignore[import-untyped] # it has no annotations
    import numba

    types: Any = numba.types  # the annotations of what follows are incomplete
    njit: Any = numba.njit
    cfunc: Any = numba.cfunc

    def numba_type(name: str) -> Any:
        kind = getattr(types, name.rstrip("*"))
        return types.CPointer(kind) if name.endswith("*") else kind

    options: dict[str, Any] = {
        "nogil": True,
        "fastmath": False,
        "error_model": "numpy",  # a division by zero gives what IEEE 754 says, and raises nothing
        "_nrt": False,  # nothing is allocated
    }
    external = {unit.function_name: types.ExternalFunction(unit.symbol, unit.signature) for unit in linked}
    for unit in linked:
        llvm.add_symbol(unit.symbol, unit.address)
    digest = hashlib.sha256(repr(sorted(unit.symbol for unit in linked)).encode())
    done: dict[str, Any] = dict(external)
    for callee in _callees_first(function, set(done)):
        inline = callee in getattr(sys.modules[callee.__module__], "INLINE", ())
        digest.update(_identity(callee) + bytes([inline]))
        if callee.__name__ == "prefetch":
            done["prefetch"] = _prefetch()
        elif callee is not function:
            shared = _compiled_before if external.keys().isdisjoint(_called(callee)) else {}
            if callee not in shared:
                # Nobody but other compiled code calls it: no need for the way in from Python or C.
                inner = njit(**options, no_cpython_wrapper=True, no_cfunc_wrapper=True, forceinline=inline)
                shared[callee] = inner(_copy(callee, done, callee.__name__))
            done[callee.__name__] = shared[callee]
    name = f"{function.__name__}_{digest.hexdigest()[:16]}"
    signature = numba_type(result)(*map(numba_type, arguments))
    unit = cfunc(signature, cache=True, **options)(_copy(function, done, name))
    unit.symbol, unit.function_name, unit.signature = f"carom_{name}", function.__name__, signature
    return unit


#: Functions that call nothing of another unit, and so can stand in several.
_compiled_before: dict[Any, Any] = {}


def prefetch(column: Any, place: int) -> None:
    """Ask for the cache line of a place in an array before it is needed; plain Python has no use for that."""


@functools.cache
def _prefetch() -> Any:
    """Return what stands in for `prefetch` in compiled code: the processor's own instruction."""
    from llvmlite import ir
    from numba.core import types
    from numba.extending import intrinsic

    def typed(_: Any, pointer: Any, place: Any) -> Any:
        def generate(context: Any, builder: Any, __: Any, arguments: Any) -> Any:
            line = builder.bitcast(builder.gep(arguments[0], [arguments[1]]), ir.IntType(8).as_pointer())
            number = ir.IntType(32)
            kind = ir.FunctionType(ir.VoidType(), [line.type, number, number, number])
            called = builder.module.globals.get("llvm.prefetch.p0") or ir.Function(
                builder.module, kind, "llvm.prefetch.p0"
            )
            # To be read, into all levels of the cache, of data.
            builder.call(called, [line, number(0), number(3), number(1)])
            return context.get_dummy_value()

        return types.void(pointer, place), generate

    return intrinsic(typed)


def addresses(*arrays: Any) -> list[Any]:
    """Return pointers to the data of NumPy arrays, as a unit takes them."""
    import ctypes

    from numpy.ctypeslib import as_ctypes_type

    return [array.ctypes.data_as(ctypes.POINTER(as_ctypes_type(array.dtype))) for array in arrays]


def _callees_first(function: Any, seen: set[str]) -> Iterator[Any]:
    """Yield the functions of Carom that `function` calls, directly or not, callees first, and itself last."""
    seen.add(function.__name__)
    for name in function.__code__.co_names:
        called = function.__globals__.get(name)
        if isinstance(called, FunctionType) and called.__module__.startswith("carom.") and name not in seen:
            yield from _callees_first(called, seen)
    yield function


def _called(function: Any) -> set[str]:
    """Return the names of the functions of Carom that `function` calls, directly or not."""
    return {called.__name__ for called in _callees_first(function, set())} - {function.__name__}


def _identity(function: Any) -> bytes:
    """Return what a function's machine code hangs on: its byte code, and the numbers it finds by name."""
    code = function.__code__
    known = {name: function.__globals__.get(name) for name in code.co_names}
    numbers = sorted((name, value) for name, value in known.items() if isinstance(value, int | float))
    return marshal.dumps((code.co_code, repr(code.co_consts), numbers))


def _copy(function: Any, done: dict[str, Any], name: str) -> FunctionType:
    """Return a copy that finds the functions already compiled in place of their plain namesakes."""
    copy = FunctionType(function.__code__, {**function.__globals__, **done}, name)
    copy.__module__, copy.__qualname__ = function.__module__, name
    return copy
