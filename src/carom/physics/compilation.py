"""The same functions, compiled: one source runs as plain Python and, where numba is installed, as machine code.

A module lists its kernel functions in ``KERNEL``, callees first, and those to be inlined in ``INLINE``. `compiled`
gives each of them a copy of its globals in which the functions already compiled stand in for their plain namesakes, and
compiles that copy; the originals stay as they are. Contraction and reordering stay off (`fastmath=False`; LLVM fuses no
multiply and add without leave), so both forms give the same bits. The result is cached on disk by numba, beside the
source or in the user's cache directory.
"""

from __future__ import annotations

import functools
import importlib
import importlib.util
from collections.abc import Callable
from types import FunctionType, SimpleNamespace
from typing import Any

from carom.physics import double_double, pair_time

__all__ = ["compiled", "compiled_error_free", "numba_installed"]


@functools.cache
def numba_installed() -> bool:
    """Whether numba can be imported; looking does not import it."""
    return importlib.util.find_spec("numba") is not None


@functools.cache
def compiled(*modules: str) -> SimpleNamespace:
    """Return the kernel functions of the named modules, compiled, as attributes.

    Args:
        modules: Full names of modules with a ``KERNEL``; those that others call first.
    """
    done: dict[str, Any] = {}
    for name in modules:
        module = importlib.import_module(name)
        _compile(module.KERNEL, module.INLINE, done)
    return SimpleNamespace(**done)


@functools.cache
def compiled_error_free() -> Any:
    """Return `exact_pair_time` compiled, as a function pointer: its callers call it and do not contain it."""
    from numba import cfunc, float64

    done: dict[str, Any] = {}
    _compile(double_double.KERNEL, double_double.INLINE, done)
    _compile(pair_time.ERROR_FREE[:-1], (), done)
    copy = _with_globals(pair_time.exact_pair_time, done)
    return cfunc(float64(*[float64] * 10), cache=True, error_model="numpy")(copy)


def _compile(
    functions: tuple[Callable[..., Any], ...], inline: tuple[Callable[..., Any], ...], done: dict[str, Any]
) -> None:
    """Compile `functions` in order, each seeing those in `done`, and add them to it."""
    import numba

    njit: Any = numba.njit  # numba's annotations leave out `_nrt`
    for function in functions:
        done[function.__name__] = njit(
            cache=True,
            nogil=True,
            fastmath=False,
            error_model="numpy",  # a division by zero gives what IEEE 754 says, and raises nothing
            forceinline=function in inline,  # a call costs more than the smallest functions themselves
            _nrt=False,  # nothing is allocated; counting references to the arrays took half of the time
        )(_with_globals(function, done))


def _with_globals(function: Any, done: dict[str, Any]) -> FunctionType:
    copy = FunctionType(function.__code__, {**function.__globals__, **done}, function.__name__)
    copy.__module__, copy.__qualname__ = function.__module__, function.__qualname__
    return copy
