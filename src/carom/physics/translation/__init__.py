"""From Python's syntax to LLVM's intermediate representation, for the part of Python that Carom's inner loops use.

The part: numbers (float64, int64, bool), columns, which are pointers into arrays, and tuples of these, named ones too;
arithmetic, comparisons, `if`, `while`, `for` over `range` or a tuple; calls of other such functions, of a unit, of
`abs`, `bool`, `float`, `int`, `max`, `min`, `range`, of `math.frexp`, `math.ldexp` and `math.sqrt`, and of
`carom.physics.compilation.prefetch`. Anything else is refused, with its place.

What Python and this do alike: each float operation is one operation of IEEE 754, in the order written (expressions of
constants are evaluated by Python itself); division and shifts of integers round down; a tuple's parts are evaluated
before any is assigned. What differs: integers have 64 bits; where Python would raise (division by zero, the root of a
negative number, an overflow), IEEE 754 says what comes out; indices are not checked.

A function is translated once for each combination of argument types. A variable has one type; integers become floats
where the other branch, or an earlier assignment, is one.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from carom.physics.machine_code import LIBRARY, pointer_name
from carom.physics.translation.statements import Function
from carom.physics.translation.values import KINDS, External, Translated, TranslationError, llvm_type

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

__all__ = ["External", "TranslationError", "translate"]

# LLVM makes calls of `memset` of loops that clear an array; with one in the module nothing outside is called.
_PRELUDE = """\
declare double @llvm.fabs.f64(double)
declare double @llvm.sqrt.f64(double)
declare i64 @llvm.abs.i64(i64, i1)
declare void @llvm.prefetch.p0(ptr, i32, i32, i32)
@llvm.compiler.used = appending global [1 x ptr] [ptr @memset]
define internal ptr @memset(ptr %to, i32 %value, i64 %count) nounwind noinline "no-builtins" {
entry:
  %byte = trunc i32 %value to i8
  br label %head
head:
  %k = phi i64 [ 0, %entry ], [ %next, %body ]
  %more = icmp ult i64 %k, %count
  br i1 %more, label %body, label %end
body:
  %place = getelementptr i8, ptr %to, i64 %k
  store i8 %byte, ptr %place
  %next = add nuw i64 %k, 1
  br label %head
end:
  ret ptr %to
}
"""


def translate(
    function: Callable[..., Any], symbol: str, result: str, arguments: Sequence[str], linked: Mapping[str, External]
) -> str:
    """Return a function and all of Carom's that it calls as a module of LLVM's intermediate representation.

    What it calls outside itself (linked units, `LIBRARY`) it calls by pointers, which the loader
    sets, see `pointer_name`.

    Args:
        function: The function.
        symbol: What it is to be called in machine code; all others stay private.
        result: Type of its result, "float64" or "int64".
        arguments: Types of its arguments; "float64*" is a pointer into an array. Arrays that are written to must not
            overlap others.
        linked: Functions that are called as they are, by their name in the source.

    Raises:
        TranslationError: Something in it is outside the part of Python that can be translated.
    """
    module = _Module(symbol, linked)
    shapes = tuple(KINDS.get(name, name) for name in arguments)
    inner = module.translated(function, shapes)
    if inner.result != KINDS[result]:
        raise TranslationError(f"{function.__name__} returns {inner.result}, not {result}")
    kinds = [llvm_type(kind) for kind in shapes]
    # The kernel is some 2 % faster where a write to one column is known to leave the others as they are.
    parameters = ", ".join(f"{kind} noalias %{k}" if kind == "ptr" else f"{kind} %{k}" for k, kind in enumerate(kinds))
    passed = ", ".join(f"{kind} %{k}" for k, kind in enumerate(kinds))
    module.texts.append(
        f"define {inner.result} @{symbol}({parameters}) nounwind {{\n"
        f"  %r = call {inner.result} @{inner.name}({passed})\n  ret {inner.result} %r\n}}\n"
    )
    return _PRELUDE + "\n".join(module.texts)


class _Module:
    """The functions translated so far."""

    def __init__(self, symbol: str, linked: Mapping[str, External]) -> None:
        self.symbol, self.linked = symbol, linked
        called = (*LIBRARY, *(each.symbol for each in linked.values()))
        self.texts = [f"@{pointer_name(symbol, name)} = dso_local global ptr null" for name in called]
        self._done: dict[tuple[Any, Any], Translated | None] = {}

    def translated(self, function: Any, shapes: tuple[Any, ...]) -> Translated:
        """Return a function for arguments of given types."""
        key = function, shapes
        if key not in self._done:
            self._done[key] = None
            body = Function(self, function, shapes, f"{function.__name__}.{len(self._done)}")
            self._done[key] = Translated(body.name, body.result)
            self.texts.append(body.text)
        done = self._done[key]
        if done is None:
            raise TranslationError(f"{function.__module__}.{function.__name__} calls itself")
        return done
