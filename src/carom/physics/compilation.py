"""The same functions, compiled: one source runs as plain Python and, where numba is installed, as machine code.

A function and all of Carom's functions that it calls become one *unit*: a C function on numbers and on pointers into
arrays. The originals stay as they are. Contraction and reordering stay off, so both forms give the same bits. What a
unit calls of another unit stays in that other, which several can share. numba turns a unit into LLVM's intermediate
representation (`carom.physics.lowering`), and LLVM that into an object file (`carom.physics.machine_code`), which is
kept on disk under a digest of all that went into it (`carom.physics.object_cache`); a later start only loads it.
"""

from __future__ import annotations

import contextlib
import ctypes
import functools
import hashlib
import importlib.util
import marshal
import os
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path
from types import FunctionType, ModuleType
from typing import TYPE_CHECKING, Any

from carom.errors import CaromError
from carom.physics import machine_code, object_cache, translations

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator

__all__ = [
    "Recipe",
    "Unit",
    "addresses",
    "compiled_unit",
    "compiler_installed",
    "is_cached",
    "is_translated",
    "prefetch",
    "translation",
]


@dataclass(frozen=True)
class Recipe:
    """What a unit is made of.

    Attributes:
        function: The function. Its calls of other functions of Carom become calls of their compiled copies.
        result: Type of its result: "float64" or "int64".
        arguments: Types of its arguments; "float64*" is a pointer into an array. Arrays that are written to must not
            overlap others.
        linked: Units that this one calls, by the names of their functions, instead of compiling their code into itself.
        vectors: Whether LLVM may take several passes of a loop at a time: good for arrays, bad for the kernel.
    """

    function: Callable[..., Any]
    result: str
    arguments: tuple[str, ...]
    linked: tuple[Recipe, ...] = ()
    vectors: bool = False

    def name(self) -> str:
        """Return the function's name with a digest of the code of the unit, and of those linked to it."""
        digest = hashlib.sha256(_translator())
        digest.update(repr((self.result, self.arguments, self.vectors, [each.name() for each in self.linked])).encode())
        for callee in _callees(self.function, {each.function.__name__ for each in self.linked}, {}):
            digest.update(_identity(callee))
        return f"{self.function.__name__}_{digest.hexdigest()[:16]}"


@dataclass(frozen=True)
class Unit:
    """A compiled function.

    Attributes:
        address: Where it is.
        ctypes: It, to be called from Python.
    """

    address: int
    ctypes: Callable[..., Any]


@functools.cache
def compiler_installed() -> bool:
    """Whether numba, and llvmlite with it, can be imported; looking imports neither."""
    return importlib.util.find_spec("numba") is not None


def is_cached(recipe: Recipe) -> bool:
    """Whether a unit seems to be on disk, so that it need only be loaded; looking imports nothing."""
    return all(map(is_cached, recipe.linked)) and object_cache.holds(_source(recipe), recipe.name())


def is_translated(recipe: Recipe) -> bool:
    """Whether a unit came with the package, so that LLVM alone can compile it; looking imports nothing."""
    return all(map(is_translated, recipe.linked)) and translations.holds(recipe.name())


@functools.cache
def compiled_unit(recipe: Recipe) -> Unit:
    """Return a unit: from this process, from the disk, or compiled now.

    Raises:
        CaromError: numba could not compile it.
    """
    name = recipe.name()
    symbol, key = _symbol(name), f"{name} {machine_code.target_name()}"
    emitted = object_cache.read(_source(recipe), name, key)
    with contextlib.ExitStack() as stack:
        codes = translations.read(name) if emitted is None else None
        if emitted is None and codes is None:  # begun first, so that numba works on what is linked at the same time
            lowering = stack.enter_context(_lowering(recipe, symbol))
        linked = {_symbol(each.name()): compiled_unit(each).address for each in recipe.linked}
        if emitted is None:
            emitted = machine_code.object_file(symbol, *(codes or lowering()), vectors=recipe.vectors)
            object_cache.write(_source(recipe), name, key, emitted)
    address = machine_code.address_of(symbol, emitted, linked)
    call = ctypes.CFUNCTYPE(_ctype(recipe.result), *map(_ctype, recipe.arguments))
    return Unit(address, call(address))


def prefetch(column: Any, place: int) -> None:
    """Ask for the cache line of a place in an array before it is needed; plain Python has no use for that."""


def addresses(*arrays: Any) -> list[Any]:
    """Return pointers to the data of NumPy arrays, as a unit takes them."""
    return [array.ctypes.data_as(_ctype(f"{array.dtype.name}*")) for array in arrays]


def translation(recipe: Recipe) -> list[str]:
    """Return a unit as numba makes it, in LLVM's intermediate representation: what comes with a package.

    Raises:
        CaromError: numba could not compile it.
    """
    with _lowering(recipe, _symbol(recipe.name())) as answer:
        return answer()


@contextlib.contextmanager
def _lowering(recipe: Recipe, symbol: str) -> Iterator[Callable[[], list[str]]]:
    """Have numba work on a unit in a process of its own, which does not outlive this context; yield what waits for it.

    None of numba's settings that the environment names hold there, and numba does not optimise what LLVM will.
    """
    linked = {each.function.__name__: each for each in recipe.linked}
    sources = tuple(map(_parts, _callees(recipe.function, set(linked), {})))
    externals = tuple((name, _symbol(each.name()), each.result, each.arguments) for name, each in linked.items())
    settings = {name: value for name, value in os.environ.items() if not name.startswith("NUMBA_")}
    paths = os.pathsep.join(path or os.curdir for path in sys.path)
    with tempfile.TemporaryFile() as request:
        request.write(marshal.dumps((symbol, recipe.result, recipe.arguments, sources, externals)))
        request.seek(0)
        process = subprocess.Popen(
            [sys.executable, "-P", "-m", "carom.physics.lowering"],
            stdin=request,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            env=settings | {"NUMBA_OPT": "0", "PYTHONPATH": paths},
        )

    def answer() -> list[str]:
        codes, complaint = process.communicate()
        if process.returncode != 0:
            raise CaromError(
                f"numba could not compile {recipe.function.__module__}.{recipe.function.__name__}:\n"
                f"{complaint.decode(errors='replace').strip()}\n"
                "Try another version of numba (pip install -U 'carom[fast]'), or go without (compiled=False)."
            )
        modules: list[str] = marshal.loads(codes)  # noqa: S302 - of the process just started
        return modules

    with process:
        try:
            yield answer
        finally:
            process.kill()


def _parts(function: Any) -> tuple[Any, ...]:
    """Return all of a function that its machine code hangs on, see `carom.physics.lowering.Source`."""
    code, names = function.__code__, function.__globals__
    found = [(name, names[name]) for name in code.co_names if name in names]
    return (
        code,
        function.__module__,
        tuple((name, value) for name, value in found if isinstance(value, int | float)),
        tuple((name, value._fields) for name, value in found if hasattr(value, "_fields")),
        tuple((name, value.__name__) for name, value in found if isinstance(value, ModuleType)),
        function in names.get("INLINE", ()),  # what its module says costs less than a call
    )


def _symbol(name: str) -> str:
    return f"carom_{name}"


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
    """Return the same as `_parts` does, without what two starts of Python write in two ways."""
    code, *parts = _parts(function)
    return marshal.dumps((code.co_name, code.co_code, repr(code.co_consts), code.co_names, *parts))


@functools.cache
def _translator() -> bytes:
    """Return a digest of the source by which functions become machine code."""
    home = Path(__file__).parent
    files = [home / "machine_code.py", home / "lowering.py"]
    return hashlib.sha256(b"".join(file.read_bytes() for file in files)).digest()
