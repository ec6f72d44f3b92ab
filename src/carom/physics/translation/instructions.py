"""Instructions of LLVM's intermediate representation, of which a function's text is put together."""

from __future__ import annotations

import ast
import operator
import struct
from typing import TYPE_CHECKING, Any

from carom.physics.translation.values import (
    BOOL,
    ELEMENTS,
    FLOAT,
    INT,
    WIDENS,
    TranslationError,
    Value,
    flat,
    llvm_type,
    shape_of,
    tuple_like,
)

if TYPE_CHECKING:
    from collections.abc import Callable

__all__ = ["FOLD", "Instructions"]

FOLD: dict[type[ast.AST], Callable[..., Any]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
    ast.FloorDiv: operator.floordiv,
    ast.Mod: operator.mod,
    ast.Pow: operator.pow,
    ast.LShift: operator.lshift,
    ast.RShift: operator.rshift,
    ast.BitAnd: operator.and_,
    ast.BitOr: operator.or_,
    ast.BitXor: operator.xor,
    ast.USub: operator.neg,
    ast.UAdd: operator.pos,
    ast.Not: operator.not_,
    ast.Lt: operator.lt,
    ast.LtE: operator.le,
    ast.Gt: operator.gt,
    ast.GtE: operator.ge,
    ast.Eq: operator.eq,
    ast.NotEq: operator.ne,
}
_FLOAT_OPERATIONS = {ast.Add: "fadd", ast.Sub: "fsub", ast.Mult: "fmul", ast.Div: "fdiv"}
_INT_OPERATIONS = {ast.Add: "add", ast.Sub: "sub", ast.Mult: "mul", ast.LShift: "shl", ast.RShift: "ashr"}
_BIT_OPERATIONS = {ast.BitAnd: "and", ast.BitOr: "or", ast.BitXor: "xor"}
# A comparison with a NaN is false but for "unequal", as in Python.
_COMPARISONS = {
    ast.Lt: ("olt", "slt"),
    ast.LtE: ("ole", "sle"),
    ast.Gt: ("ogt", "sgt"),
    ast.GtE: ("oge", "sge"),
    ast.Eq: ("oeq", "eq"),
    ast.NotEq: ("une", "ne"),
}


class Instructions:
    """The text of a function as it grows: instructions, labels, variables, and what is done with numbers.

    Variables live in memory (`alloca`) here; LLVM's first pass makes registers of them.
    """

    def __init__(self, function: Any) -> None:
        self._function = function
        self._entry: list[str] = []
        self._lines: list[str] = []
        self._slots: dict[str, Any] = {}
        self._count = 0
        self._block, self._dead = "entry", False

    def _emit(self, kind: str, instruction: str) -> Value:
        self._count += 1
        self._lines.append(f"%v{self._count} = {instruction}")
        return Value(kind, f"%v{self._count}")

    def _emit_plain(self, instruction: str) -> None:
        self._lines.append(instruction)

    def _label(self) -> str:
        self._count += 1
        return f"b{self._count}"

    def _begin(self, label: str) -> None:
        self._lines.append(f"\n{label}:")
        self._block, self._dead = label, False

    def _jump(self, label: str) -> None:
        if not self._dead:
            self._lines.append(f"br label %{label}")
            self._dead = True

    def _branch(self, test: Value, yes: str, no: str) -> None:
        self._lines.append(f"br i1 {test.text}, label %{yes}, label %{no}")
        self._dead = True

    def _refused(self, node: Any, what: str) -> TranslationError:
        code = self._function.__code__
        line = getattr(node, "lineno", code.co_firstlineno)
        return TranslationError(f"{code.co_filename}:{line}: {what} cannot be compiled")

    # Types.

    def _common(self, node: ast.AST, one: Any, other: Any) -> Any:
        """Return the type that holds values of two types."""
        if isinstance(one, tuple) and isinstance(other, tuple) and len(one) == len(other):
            return tuple_like(one, (self._common(node, a, b) for a, b in zip(one, other, strict=True)))
        if one in WIDENS and other in WIDENS:
            return max(one, other, key=WIDENS.index)
        if one != other:
            raise self._refused(node, f"a value that is {one} here and {other} there")
        return one

    def _converted(self, node: ast.AST, value: Any, shape: Any) -> Any:
        """Return a value as one of a wider type, constants as operands of instructions."""
        if isinstance(shape, tuple):
            if not isinstance(value, tuple) or len(value) != len(shape):
                raise self._refused(node, f"{shape_of(value)} in place of {shape}")
            return tuple_like(shape, (self._converted(node, v, s) for v, s in zip(value, shape, strict=True)))
        kind = shape_of(value)
        if kind != shape and (kind not in WIDENS or self._common(node, kind, shape) != shape):
            raise self._refused(node, f"{kind} in place of {shape}")
        if isinstance(value, bool | int | float):
            return Value(shape, self._literal(node, value, shape))
        if kind == shape:
            return value
        operation = "zext" if kind == BOOL and shape == INT else "uitofp" if kind == BOOL else "sitofp"
        return self._emit(shape, f"{operation} {kind} {value.text} to {shape}")

    def _literal(self, node: ast.AST, value: float, kind: str) -> str:
        if kind == FLOAT:
            return f"0x{struct.pack('>d', value).hex().upper()}"
        if kind == BOOL:
            return "true" if value else "false"
        if not -(2**63) <= value < 2**63:
            raise self._refused(node, f"an integer of more than 64 bits, {value},")
        return str(int(value))

    # Variables and elements of columns.

    def _store_name(self, node: ast.AST, name: str, value: Any) -> None:
        if name not in self._slots:
            self._slots[name] = self._new_slot(shape_of(value))
        slot = self._slots[name]
        value = self._converted(node, value, shape_of(slot))
        for place, part in zip(flat(slot), flat(value), strict=True):
            self._emit_plain(f"store {llvm_type(part.kind)} {part.text}, ptr {place.text}")

    def _new_slot(self, shape: Any) -> Any:
        if isinstance(shape, tuple):
            return tuple_like(shape, map(self._new_slot, shape))
        self._count += 1
        self._entry.append(f"%s{self._count} = alloca {llvm_type(shape)}")
        return Value(shape, f"%s{self._count}")

    def _loaded(self, slot: Any) -> Any:
        if isinstance(slot, tuple):
            return tuple_like(slot, map(self._loaded, slot))
        return self._emit(slot.kind, f"load {llvm_type(slot.kind)}, ptr {slot.text}")

    def _element(self, node: ast.AST, column: Any, index: Any) -> tuple[str, str]:
        """Return the kind of a column, and the address of an element."""
        if shape_of(column) not in ELEMENTS:
            raise self._refused(node, f"indexing {shape_of(column)}")
        place = self._converted(node, index, INT)
        held = ELEMENTS[column.kind][0]
        return column.kind, self._emit("ptr", f"getelementptr {held}, ptr {column.text}, i64 {place.text}").text

    def _read(self, column: str, address: str) -> Value:
        held, widens = ELEMENTS[column]
        value = self._emit(held, f"load {held}, ptr {address}")
        return value if widens is None else self._emit(INT, f"{widens} {held} {value.text} to i64")

    def _write(self, node: ast.AST, column: str, address: str, value: Any) -> None:
        held, widens = ELEMENTS[column]
        value = self._converted(node, value, INT if widens else held)
        if widens:
            value = self._emit(held, f"trunc i64 {value.text} to {held}")
        self._emit_plain(f"store {held} {value.text}, ptr {address}")

    # Arithmetic.

    def _arithmetic(self, node: ast.AST, sign: ast.operator, a: Any, b: Any) -> Any:
        if isinstance(a, bool | int | float) and isinstance(b, bool | int | float):
            return FOLD[type(sign)](a, b)
        kinds = {shape_of(a), shape_of(b)}
        operation = type(sign)
        if not kinds <= set(WIDENS):
            raise self._refused(node, f"{operation.__name__} of {' and '.join(map(str, kinds))}")
        if kinds == {BOOL} and operation in _BIT_OPERATIONS:
            return self._binary(node, _BIT_OPERATIONS[operation], BOOL, a, b)
        if operation in _FLOAT_OPERATIONS and (FLOAT in kinds or operation is ast.Div):
            return self._binary(node, _FLOAT_OPERATIONS[operation], FLOAT, a, b)
        if FLOAT not in kinds and operation in (_INT_OPERATIONS | _BIT_OPERATIONS):
            return self._binary(node, (_INT_OPERATIONS | _BIT_OPERATIONS)[operation], INT, a, b)
        if FLOAT not in kinds and operation in (ast.FloorDiv, ast.Mod):
            return self._rounded_down(node, operation is ast.FloorDiv, a, b)
        raise self._refused(node, f"{operation.__name__} of {' and '.join(sorted(kinds))}")

    def _binary(self, node: ast.AST, operation: str, kind: str, a: Any, b: Any) -> Value:
        left, right = self._converted(node, a, kind), self._converted(node, b, kind)
        return self._emit(kind, f"{operation} {kind} {left.text}, {right.text}")

    def _rounded_down(self, node: ast.AST, quotient: bool, a: Any, b: Any) -> Value:
        """Return quotient or remainder of integers; LLVM's round towards zero, Python's down."""
        a, b = self._converted(node, a, INT), self._converted(node, b, INT)
        rest = self._binary(node, "srem", INT, a, b)
        opposed = self._emit(BOOL, f"icmp slt i64 {self._binary(node, 'xor', INT, rest, b).text}, 0")
        inexact = self._emit(BOOL, f"icmp ne i64 {rest.text}, 0")
        down = self._converted(node, self._binary(node, "and", BOOL, opposed, inexact), INT)
        if quotient:
            return self._binary(node, "sub", INT, self._binary(node, "sdiv", INT, a, b), down)
        return self._binary(node, "add", INT, rest, self._binary(node, "mul", INT, down, b))

    def _comparison(self, node: ast.AST, sign: ast.cmpop, a: Any, b: Any) -> Any:
        if type(sign) not in _COMPARISONS or not {shape_of(a), shape_of(b)} <= set(WIDENS):
            raise self._refused(node, f"{type(sign).__name__} of {shape_of(a)} and {shape_of(b)}")
        if isinstance(a, bool | int | float) and isinstance(b, bool | int | float):
            return FOLD[type(sign)](a, b)
        kind = self._common(node, self._common(node, shape_of(a), shape_of(b)), INT)
        of_floats, of_integers = _COMPARISONS[type(sign)]
        return Value(
            BOOL, self._binary(node, f"fcmp {of_floats}" if kind == FLOAT else f"icmp {of_integers}", kind, a, b).text
        )

    def _truth_of(self, node: ast.AST, value: Any) -> bool | Value:
        """Return whether a value counts as true."""
        kind = shape_of(value)
        if isinstance(value, bool | int | float):
            return bool(value)
        if kind == BOOL and isinstance(value, Value):
            return value
        if kind not in WIDENS:
            raise self._refused(node, f"{kind} as a condition")
        compared = self._comparison(node, ast.NotEq(), value, 0)
        return compared if isinstance(compared, Value) else bool(compared)
