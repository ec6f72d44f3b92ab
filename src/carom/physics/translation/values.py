"""The values and types of a function being translated."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from carom.errors import CaromError

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator

__all__ = [
    "BOOL",
    "ELEMENTS",
    "FLOAT",
    "INT",
    "KINDS",
    "WIDENS",
    "External",
    "Translated",
    "TranslationError",
    "Value",
    "flat",
    "llvm_type",
    "rebuilt",
    "result_type",
    "shape_of",
    "tuple_like",
]

# Types: three of LLVM's, pointers ("float64*" and so on), and tuples of types.
FLOAT, INT, BOOL = "double", "i64", "i1"
WIDENS = (BOOL, INT, FLOAT)
KINDS = {"float64": FLOAT, "int64": INT}
#: What an array holds, and how that is widened when it is read.
ELEMENTS = {
    "float64*": ("double", None),
    "int64*": ("i64", None),
    "int32*": ("i32", "sext"),
    "uint8*": ("i8", "zext"),
}


class TranslationError(CaromError):
    """A function uses a part of Python that cannot be compiled."""


@dataclass(frozen=True, slots=True)
class External:
    """A compiled function to be called by its symbol; types as in `carom.physics.compilation.compiled_unit`."""

    symbol: str
    result: str
    arguments: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Value:
    """The result of an instruction, or a variable's place in memory; constants are plain numbers of Python."""

    kind: str
    text: str


@dataclass(frozen=True, slots=True)
class Translated:
    """A function of the module: its name there, and the type of its result, None where nothing is returned."""

    name: str
    result: Any


def shape_of(value: Any) -> Any:
    """Return the type of a value."""
    if isinstance(value, tuple):
        return tuple_like(value, map(shape_of, value))
    if isinstance(value, Value):
        return value.kind
    return BOOL if isinstance(value, bool) else INT if isinstance(value, int) else FLOAT


def tuple_like(whole: tuple[Any, ...], parts: Iterable[Any]) -> tuple[Any, ...]:
    """Return a tuple of parts, with the names that those of another tuple have."""
    make: Callable[[Iterable[Any]], tuple[Any, ...]] = getattr(whole, "_make", tuple)
    return make(parts)


def flat(value: Any) -> Iterator[Any]:
    """Yield the numbers, or the types, that a tuple of tuples is made of."""
    if isinstance(value, tuple):
        for part in value:
            yield from flat(part)
    else:
        yield value


def rebuilt(shape: Any, leaves: Iterator[Value]) -> Any:
    """Undo `flat`."""
    return tuple_like(shape, (rebuilt(part, leaves) for part in shape)) if isinstance(shape, tuple) else next(leaves)


def llvm_type(kind: str) -> str:
    """Return LLVM's name of a type."""
    return "ptr" if kind.endswith("*") else kind


def result_type(shape: Any) -> str:
    """Return LLVM's type of a result; parts of a tuple travel side by side."""
    if shape is None:
        return "void"
    leaves = [llvm_type(kind) for kind in flat(shape)]
    return leaves[0] if len(leaves) == 1 else f"{{ {', '.join(leaves)} }}"
