"""From Python's syntax to LLVM's intermediate representation, for the part of Python that Carom's inner loops use.

The part: numbers (float64, int64, bool), tuples of them, and columns, which are pointers into arrays; arithmetic,
comparisons, `if`, `while`, `for` over `range` or a tuple; calls of other such functions, of a unit, of `abs`, `bool`,
`float`, `int`, `max`, `min`, `range`, and of `math.frexp`, `math.ldexp` and `math.sqrt`. Anything else is refused, with
its place. What Python and this do alike: each float operation is one operation of IEEE 754, in the order written
(expressions of constants are evaluated by Python itself); division and shifts of integers round down; a tuple's parts
are evaluated before any is assigned. What differs: integers have 64 bits, and where Python would raise (division by
zero, the root of a negative number, an overflow), IEEE 754 says what comes out. Indices count from 0 and are not checked.

A function is translated once for each combination of argument types. A variable has one type; integers become floats
where the other branch, or an earlier assignment, is one.
"""

from __future__ import annotations

import ast
import builtins
import functools
import math
import operator
import struct
import types
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from carom.errors import CaromError

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence

__all__ = ["External", "TranslationError", "inlined", "translate"]

# Types: three of LLVM's, pointers ("float64*" and so on), and tuples of types.
FLOAT, INT, BOOL = "double", "i64", "i1"
_WIDENS = (BOOL, INT, FLOAT)
_OF_NAME = {"float64": FLOAT, "int64": INT}
#: What an array holds, and how that is widened when it is read.
_ELEMENTS = {
    "float64*": ("double", None),
    "int64*": ("i64", None),
    "int32*": ("i32", "sext"),
    "uint8*": ("i8", "zext"),
}
_DECLARATIONS = """\
declare double @llvm.fabs.f64(double)
declare double @llvm.sqrt.f64(double)
declare i64 @llvm.abs.i64(i64, i1)
declare double @ldexp(double, i32)
declare double @frexp(double, ptr)
"""
_FOLD: dict[type[ast.AST], Callable[..., Any]] = {
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


class TranslationError(CaromError):
    """A function uses a part of Python that cannot be compiled."""


@dataclass(frozen=True, slots=True)
class External:
    """A compiled function to be called by its symbol; types as in `carom.physics.compilation.compiled_unit`."""

    symbol: str
    result: str
    arguments: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class _Value:
    """The result of an instruction, or a variable's place in memory; constants are plain numbers of Python."""

    kind: str
    text: str


@dataclass(frozen=True, slots=True)
class _Translated:
    name: str
    result: Any  # a type; None where nothing is returned


def inlined(function: Any) -> bool:
    """Whether the module of a function lists it as one that costs less than a call."""
    return function.__name__ in {each.__name__ for each in function.__globals__.get("INLINE", ())}


def translate(
    function: Callable[..., Any], symbol: str, result: str, arguments: Sequence[str], linked: Mapping[str, External]
) -> str:
    """Return a function and all of Carom's that it calls as a module of LLVM's intermediate representation.

    Args:
        function: The function.
        symbol: What it is to be called in machine code; all others stay private.
        result: Type of its result, "float64" or "int64".
        arguments: Types of its arguments; "float64*" is a pointer into an array.
        linked: Functions that are called as they are, by their name in the source.

    Raises:
        TranslationError: Something in it is outside the part of Python that can be translated.
    """
    module = _Module(linked)
    shapes = tuple(_OF_NAME.get(name, name) for name in arguments)
    inner = module.translated(function, shapes)
    if inner.result != _OF_NAME[result]:
        raise TranslationError(f"{function.__name__} returns {inner.result}, not {result}")
    parameters = ", ".join(f"{_llvm(kind)} noundef %{k}" for k, kind in enumerate(shapes))
    module.texts.append(
        f"define {inner.result} @{symbol}({parameters}) nounwind {{\n"
        f"  %r = call {inner.result} @{inner.name}({parameters.replace(' noundef', '')})\n  ret {inner.result} %r\n}}\n"
    )
    return _DECLARATIONS + "\n".join(module.texts)


class _Module:
    """The functions translated so far."""

    def __init__(self, linked: Mapping[str, External]) -> None:
        self.linked = linked
        self.texts = [
            f"declare {_OF_NAME[each.result]} @{each.symbol}"
            f"({', '.join(_llvm(_OF_NAME.get(name, name)) for name in each.arguments)})"
            for each in linked.values()
        ]
        self._done: dict[tuple[Any, Any], _Translated | None] = {}

    def translated(self, function: Any, shapes: tuple[Any, ...]) -> _Translated:
        """Return a function for arguments of given types."""
        key = function, shapes
        if key not in self._done:
            self._done[key] = None
            body = _Function(self, function, shapes, f"{function.__name__}.{len(self._done)}")
            self._done[key] = _Translated(body.name, body.result)
            self.texts.append(body.text)
        done = self._done[key]
        if done is None:
            raise TranslationError(f"{function.__module__}.{function.__name__} calls itself")
        return done


class _Function:
    """A function being translated: one method for each kind of statement and expression.

    Variables live in memory (`alloca`) here; LLVM's first pass makes registers of them.
    """

    def __init__(self, module: _Module, function: Any, shapes: tuple[Any, ...], name: str) -> None:
        self.name, self.result = name, None
        self._module, self._function = module, function
        self._entry: list[str] = []
        self._lines: list[str] = []
        self._slots: dict[str, Any] = {}
        self._returns: list[tuple[int, ast.Return | None, Any]] = []
        self._loops: list[tuple[str, str]] = []  # where `continue` and `break` lead
        self._count = 0
        self._block, self._dead = "entry", False
        node = _syntax(function)
        parameters = [each.arg for each in node.args.args]
        if len(parameters) != len(shapes):
            raise self._refused(node, f"a call with {len(shapes)} arguments for {len(parameters)}")
        self._leaves: list[_Value] = []
        for parameter, shape in zip(parameters, shapes, strict=True):
            self._store_name(node, parameter, self._parameter(shape))
        self._run(node.body)
        if not self._dead:
            self._return(None)
        self._finish(node)
        attributes = "alwaysinline nounwind" if inlined(function) else "nounwind"
        signature = ", ".join(f"{_llvm(leaf.kind)} {leaf.text}" for leaf in self._leaves)
        lines = "\n  ".join(["entry:", *self._entry, *self._lines])
        self.text = f"define internal {_returned(self.result)} @{name}({signature}) {attributes} {{\n{lines}\n}}\n"

    def _parameter(self, shape: Any) -> Any:
        if isinstance(shape, tuple):
            return tuple(self._parameter(part) for part in shape)
        self._leaves.append(_Value(shape, f"%p{len(self._leaves)}"))
        return self._leaves[-1]

    def _finish(self, node: ast.AST) -> None:
        """Write the returns, whose common type is known only now."""
        if not self._returns:
            raise self._refused(node, "a function that never returns")
        values = [value for _, _, value in self._returns]
        if all(value is None for value in values):
            for place, _, _ in self._returns:
                self._lines[place] = "ret void"
            return
        shape = _shape(values[0])
        for _, where, value in self._returns:
            if value is None:
                raise self._refused(where or node, "a function that returns a number here and none there")
            shape = self._common(where or node, shape, _shape(value))
        self.result = shape
        for place, _, value in self._returns:
            following, self._lines = self._lines, []
            leaves = list(_flat(self._converted(node, value, shape)))
            whole, kind = leaves[0], _returned(shape)
            if len(leaves) > 1:
                text = "poison"
                for k, leaf in enumerate(leaves):
                    text = self._emit(kind, f"insertvalue {kind} {text}, {leaf.kind} {leaf.text}, {k}").text
                whole = _Value(kind, text)
            self._emit_plain(f"ret {kind} {whole.text}")
            following[place] = "\n  ".join(self._lines)
            self._lines = following

    # Instructions.

    def _emit(self, kind: str, instruction: str) -> _Value:
        self._count += 1
        self._lines.append(f"%v{self._count} = {instruction}")
        return _Value(kind, f"%v{self._count}")

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

    def _branch(self, test: _Value, yes: str, no: str) -> None:
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
            return tuple(self._common(node, a, b) for a, b in zip(one, other, strict=True))
        if one in _WIDENS and other in _WIDENS:
            return max(one, other, key=_WIDENS.index)
        if one != other:
            raise self._refused(node, f"a value that is {one} here and {other} there")
        return one

    def _converted(self, node: ast.AST, value: Any, shape: Any) -> Any:
        """Return a value as one of a wider type, constants as operands of instructions."""
        if isinstance(shape, tuple):
            if not isinstance(value, tuple) or len(value) != len(shape):
                raise self._refused(node, f"{_shape(value)} in place of {shape}")
            return tuple(self._converted(node, v, s) for v, s in zip(value, shape, strict=True))
        kind = _shape(value)
        if kind != shape and (kind not in _WIDENS or self._common(node, kind, shape) != shape):
            raise self._refused(node, f"{kind} in place of {shape}")
        if isinstance(value, bool | int | float):
            return _Value(shape, self._literal(node, value, shape))
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

    def _truth(self, node: ast.expr) -> bool | _Value:
        """Return whether an expression counts as true."""
        value = self._value(node)
        kind = _shape(value)
        if isinstance(value, bool | int | float):
            return bool(value)
        if kind == BOOL:
            return value  # type: ignore[no-any-return] # a _Value by now
        if kind == INT:
            return self._emit(BOOL, f"icmp ne i64 {value.text}, 0")
        if kind == FLOAT:
            return self._emit(BOOL, f"fcmp une double {value.text}, 0.0")
        raise self._refused(node, f"{kind} as a condition")

    # Variables and elements of columns.

    def _store_name(self, node: ast.AST, name: str, value: Any) -> None:
        if name not in self._slots:
            self._slots[name] = self._new_slot(_shape(value))
        slot = self._slots[name]
        value = self._converted(node, value, _shape(slot))
        for place, part in zip(_flat(slot), _flat(value), strict=True):
            self._emit_plain(f"store {_llvm(part.kind)} {part.text}, ptr {place.text}")

    def _new_slot(self, shape: Any) -> Any:
        if isinstance(shape, tuple):
            return tuple(self._new_slot(part) for part in shape)
        self._count += 1
        self._entry.append(f"%s{self._count} = alloca {_llvm(shape)}")
        return _Value(shape, f"%s{self._count}")

    def _loaded(self, slot: Any) -> Any:
        if isinstance(slot, tuple):
            return tuple(self._loaded(part) for part in slot)
        return self._emit(slot.kind, f"load {_llvm(slot.kind)}, ptr {slot.text}")

    def _element(self, node: ast.Subscript, column: Any) -> tuple[str, str]:
        """Return the kind of a column, and the address of an element."""
        if _shape(column) not in _ELEMENTS:
            raise self._refused(node, f"indexing {_shape(column)}")
        place = self._converted(node, self._value(node.slice), INT)
        held = _ELEMENTS[column.kind][0]
        return column.kind, self._emit("ptr", f"getelementptr {held}, ptr {column.text}, i64 {place.text}").text

    def _read(self, column: str, address: str) -> _Value:
        held, widens = _ELEMENTS[column]
        value = self._emit(held, f"load {held}, ptr {address}")
        return value if widens is None else self._emit(INT, f"{widens} {held} {value.text} to i64")

    def _write(self, node: ast.AST, column: str, address: str, value: Any) -> None:
        held, widens = _ELEMENTS[column]
        value = self._converted(node, value, INT if widens else held)
        if widens:
            value = self._emit(held, f"trunc i64 {value.text} to {held}")
        self._emit_plain(f"store {held} {value.text}, ptr {address}")

    # Statements.

    def _run(self, body: Sequence[ast.stmt]) -> None:
        for node in body:
            if self._dead:
                return
            form = getattr(self, f"_run_{type(node).__name__.lower()}", None)
            if form is None:
                raise self._refused(node, f"{type(node).__name__} (a statement)")
            form(node)

    def _run_expr(self, node: ast.Expr) -> None:
        if isinstance(node.value, ast.Call):
            self._call(node.value)
        elif not isinstance(node.value, ast.Constant):
            raise self._refused(node, "an expression as a statement")

    def _run_pass(self, node: ast.Pass) -> None:
        """Do nothing."""

    def _run_assign(self, node: ast.Assign) -> None:
        value = self._value(node.value)
        for target in node.targets:
            self._assign(target, value)

    def _run_annassign(self, node: ast.AnnAssign) -> None:
        if node.value is not None:
            self._assign(node.target, self._value(node.value))

    def _assign(self, target: ast.expr, value: Any) -> None:
        if isinstance(target, ast.Name):
            self._store_name(target, target.id, value)
        elif isinstance(target, ast.Subscript):
            column, address = self._element(target, self._value(target.value))
            self._write(target, column, address, value)
        elif isinstance(target, ast.Tuple) and isinstance(value, tuple) and len(target.elts) == len(value):
            for part, each in zip(target.elts, value, strict=True):
                self._assign(part, each)
        else:
            raise self._refused(target, f"an assignment of {_shape(value)} to {ast.unparse(target)}")

    def _run_augassign(self, node: ast.AugAssign) -> None:
        if isinstance(node.target, ast.Subscript):
            column, address = self._element(node.target, self._value(node.target.value))
            before: Any = self._read(column, address)
            self._write(node, column, address, self._arithmetic(node, node.op, before, self._value(node.value)))
        elif isinstance(node.target, ast.Name):
            before = self._value(ast.copy_location(ast.Name(node.target.id, ast.Load()), node))
            self._assign(node.target, self._arithmetic(node, node.op, before, self._value(node.value)))
        else:
            raise self._refused(node, "this assignment")

    def _run_if(self, node: ast.If) -> None:
        test = self._truth(node.test)
        if isinstance(test, bool):
            self._run(node.body if test else node.orelse)
            return
        yes, no, end = self._label(), self._label(), self._label()
        self._branch(test, yes, no if node.orelse else end)
        self._begin(yes)
        self._run(node.body)
        goes_on = not self._dead or not node.orelse
        self._jump(end)
        if node.orelse:
            self._begin(no)
            self._run(node.orelse)
            goes_on = goes_on or not self._dead
            self._jump(end)
        if goes_on:
            self._begin(end)

    def _run_while(self, node: ast.While) -> None:
        head, body, end = self._label(), self._label(), self._label()
        self._jump(head)
        self._begin(head)
        test = self._truth(node.test)
        leaves = not (isinstance(test, bool) and test) or _breaks(node)
        if isinstance(test, bool):
            self._jump(body if test else end)
        else:
            self._branch(test, body, end)
        self._loop(node, body, head, end)
        self._jump(head)
        if leaves:
            self._begin(end)

    def _loop(self, node: ast.While | ast.For, body: str, following: str, end: str) -> None:
        if node.orelse:
            raise self._refused(node, "a loop with else")
        self._begin(body)
        self._loops.append((following, end))
        self._run(node.body)
        self._loops.pop()

    def _run_for(self, node: ast.For) -> None:
        call = node.iter
        if isinstance(call, ast.Call) and self._callee(call.func) is range:
            self._for_range(node, [self._value(each) for each in call.args])
            return
        parts = self._value(node.iter)
        if not isinstance(parts, tuple):
            raise self._refused(node, "a loop over anything but a range or a tuple")
        end = self._label()
        for part in parts:
            body, following = self._label(), self._label()
            self._jump(body)
            self._begin(body)
            self._assign(node.target, part)
            self._lines.append("")
            inner = self._label()
            self._jump(inner)
            self._loop(node, inner, following, end)
            self._jump(following)
            self._begin(following)
        self._jump(end)
        self._begin(end)

    def _for_range(self, node: ast.For, bounds: list[Any]) -> None:
        if len(bounds) == 1:
            bounds = [0, *bounds]
        step = bounds[2] if len(bounds) > 2 else 1
        if not isinstance(step, int) or step == 0:
            raise self._refused(node, "a range whose step is not a constant")
        start, stop = (self._converted(node, bound, INT) for bound in bounds[:2])
        head, body, following, end = (self._label() for _ in range(4))
        counter = self._new_slot(INT)
        self._emit_plain(f"store i64 {start.text}, ptr {counter.text}")
        self._jump(head)
        self._begin(head)
        now = self._loaded(counter)
        test = self._emit(BOOL, f"icmp {'slt' if step > 0 else 'sgt'} i64 {now.text}, {stop.text}")
        enter = self._label()
        self._branch(test, enter, end)
        self._begin(enter)
        self._assign(node.target, now)
        self._jump(body)
        self._loop(node, body, following, end)
        self._jump(following)
        self._begin(following)
        later = self._emit(INT, f"add nsw i64 {now.text}, {step}")
        self._emit_plain(f"store i64 {later.text}, ptr {counter.text}")
        self._jump(head)
        self._begin(end)

    def _run_continue(self, node: ast.Continue) -> None:
        self._jump(self._loops[-1][0])

    def _run_break(self, node: ast.Break) -> None:
        self._jump(self._loops[-1][1])

    def _run_return(self, node: ast.Return) -> None:
        self._return(node)

    def _return(self, node: ast.Return | None) -> None:
        value = None if node is None or node.value is None else self._value(node.value)
        self._returns.append((len(self._lines), node, value))
        self._lines.append("")
        self._dead = True

    # Expressions.

    def _value(self, node: ast.expr) -> Any:
        form = getattr(self, f"_value_{type(node).__name__.lower()}", None)
        if form is None:
            raise self._refused(node, f"{type(node).__name__} (an expression)")
        return form(node)

    def _value_constant(self, node: ast.Constant) -> Any:
        if not isinstance(node.value, bool | int | float):
            raise self._refused(node, f"the constant {node.value!r}")
        return node.value

    def _value_name(self, node: ast.Name) -> Any:
        if node.id in self._slots:
            return self._loaded(self._slots[node.id])
        value = self._function.__globals__.get(node.id)
        if not isinstance(value, bool | int | float):
            raise self._refused(node, f"the name {node.id}, which is no variable and no number,")
        return value

    def _value_attribute(self, node: ast.Attribute) -> Any:
        value = self._callee(node)
        if not isinstance(value, float):
            raise self._refused(node, ast.unparse(node))
        return value

    def _value_tuple(self, node: ast.Tuple) -> Any:
        return tuple(self._spread(node.elts))

    def _spread(self, nodes: Iterable[ast.expr]) -> Iterator[Any]:
        for node in nodes:
            if not isinstance(node, ast.Starred):
                yield self._value(node)
                continue
            parts = self._value(node.value)
            if not isinstance(parts, tuple):
                raise self._refused(node, "a star before anything but a tuple")
            yield from parts

    def _value_subscript(self, node: ast.Subscript) -> Any:
        whole = self._value(node.value)
        if not isinstance(whole, tuple):
            return self._read(*self._element(node, whole))
        which = self._value(node.slice)
        if not isinstance(which, int) or not -len(whole) <= which < len(whole):
            raise self._refused(node, "an index into a tuple that is no constant, or beyond its end,")
        return whole[which]

    def _value_unaryop(self, node: ast.UnaryOp) -> Any:
        if isinstance(node.op, ast.Not):
            test = self._truth(node.operand)
            return not test if isinstance(test, bool) else self._emit(BOOL, f"xor i1 {test.text}, true")
        value = self._value(node.operand)
        if isinstance(value, bool | int | float) and type(node.op) in _FOLD:
            return _FOLD[type(node.op)](value)
        if isinstance(node.op, ast.USub) and _shape(value) == FLOAT:
            return self._emit(FLOAT, f"fneg double {value.text}")
        if isinstance(node.op, ast.USub) and _shape(value) in _WIDENS:
            return self._emit(INT, f"sub i64 0, {self._converted(node, value, INT).text}")
        raise self._refused(node, ast.unparse(node))

    def _value_binop(self, node: ast.BinOp) -> Any:
        return self._arithmetic(node, node.op, self._value(node.left), self._value(node.right))

    def _arithmetic(self, node: ast.AST, sign: ast.operator, a: Any, b: Any) -> Any:
        if isinstance(a, bool | int | float) and isinstance(b, bool | int | float):
            return _FOLD[type(sign)](a, b)
        kinds = {_shape(a), _shape(b)}
        operation = type(sign)
        if not kinds <= set(_WIDENS):
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

    def _binary(self, node: ast.AST, operation: str, kind: str, a: Any, b: Any) -> _Value:
        left, right = self._converted(node, a, kind), self._converted(node, b, kind)
        return self._emit(kind, f"{operation} {kind} {left.text}, {right.text}")

    def _rounded_down(self, node: ast.AST, quotient: bool, a: Any, b: Any) -> _Value:
        """Return quotient or remainder of integers; LLVM's round towards zero, Python's down."""
        a, b = self._converted(node, a, INT), self._converted(node, b, INT)
        rest = self._binary(node, "srem", INT, a, b)
        opposed = self._emit(BOOL, f"icmp slt i64 {self._binary(node, 'xor', INT, rest, b).text}, 0")
        inexact = self._emit(BOOL, f"icmp ne i64 {rest.text}, 0")
        down = self._converted(node, self._binary(node, "and", BOOL, opposed, inexact), INT)
        if quotient:
            return self._binary(node, "sub", INT, self._binary(node, "sdiv", INT, a, b), down)
        return self._binary(node, "add", INT, rest, self._binary(node, "mul", INT, down, b))

    def _value_compare(self, node: ast.Compare) -> Any:
        if len(node.ops) == 1:
            return self._comparison(node, node.ops[0], self._value(node.left), self._value(node.comparators[0]))
        # a < b < c evaluates b once, and c only where a < b.
        values = [self._value(node.left), self._value(node.comparators[0])]
        tests: list[Callable[[], Any]] = [lambda: self._comparison(node, node.ops[0], *values)]
        for sign, following in zip(node.ops[1:], node.comparators[1:], strict=True):

            def test(sign: ast.cmpop = sign, following: ast.expr = following) -> Any:
                values[:] = values[1], self._value(following)
                return self._comparison(node, sign, *values)

            tests.append(test)
        return self._one_by_one(node, tests, going_on=True)

    def _comparison(self, node: ast.AST, sign: ast.cmpop, a: Any, b: Any) -> Any:
        if type(sign) not in _COMPARISONS or not {_shape(a), _shape(b)} <= set(_WIDENS):
            raise self._refused(node, f"{type(sign).__name__} of {_shape(a)} and {_shape(b)}")
        if isinstance(a, bool | int | float) and isinstance(b, bool | int | float):
            return _FOLD[type(sign)](a, b)
        kind = self._common(node, self._common(node, _shape(a), _shape(b)), INT)
        of_floats, of_integers = _COMPARISONS[type(sign)]
        return _Value(BOOL, self._binary(node, f"fcmp {of_floats}" if kind == FLOAT else f"icmp {of_integers}", kind, a, b).text)

    def _value_boolop(self, node: ast.BoolOp) -> Any:
        tests = [functools.partial(self._truth, each) for each in node.values]
        return self._one_by_one(node, tests, going_on=isinstance(node.op, ast.And))

    def _one_by_one(self, node: ast.expr, tests: list[Callable[[], Any]], *, going_on: bool) -> _Value:
        """Return the outcome of tests, of which each is made only where the one before came out as `going_on`."""
        end, arrivals = self._label(), []
        for k, test in enumerate(tests):
            value = self._converted(node, test(), BOOL)
            arrivals.append(f"[ {value.text}, %{self._block} ]")
            following = self._label()
            if k == len(tests) - 1:
                self._jump(end)
            else:
                self._branch(value, *((following, end) if going_on else (end, following)))
                self._begin(following)
        self._begin(end)
        return self._emit(BOOL, f"phi i1 {', '.join(arrivals)}")

    def _value_ifexp(self, node: ast.IfExp) -> Any:
        test = self._truth(node.test)
        if isinstance(test, bool):
            return self._value(node.body if test else node.orelse)
        labels = (self._label(), self._label())
        end = self._label()
        self._branch(test, *labels)
        before, sides = self._lines, []
        for label, side in zip(labels, (node.body, node.orelse), strict=True):
            self._lines = []
            self._begin(label)
            sides.append((self._value(side), self._lines, self._block))
        shape = self._common(node, *(_shape(value) for value, _, _ in sides))
        arrivals = []
        for value, lines, block in sides:
            self._lines, self._block, self._dead = lines, block, False
            leaves = list(_flat(self._converted(node, value, shape)))
            self._jump(end)
            before += self._lines
            arrivals.append([f"[ {leaf.text}, %{block} ]" for leaf in leaves])
        self._lines = before
        self._begin(end)
        kinds = list(_flat(shape))
        merged = iter(
            self._emit(kind, f"phi {_llvm(kind)} {one}, {other}") for kind, one, other in zip(kinds, *arrivals, strict=True)
        )
        return _rebuilt(shape, merged)

    # Calls.

    def _callee(self, node: ast.expr) -> Any:
        """Return what a name, or a name in the module `math`, stands for outside the function."""
        if isinstance(node, ast.Name) and node.id not in self._slots:
            return self._function.__globals__.get(node.id, getattr(builtins, node.id, None))
        if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name):
            module = self._callee(node.value)
            return getattr(module, node.attr, None) if module is math else None
        return None

    def _value_call(self, node: ast.Call) -> Any:
        value = self._call(node)
        if value is None:
            raise self._refused(node, f"the result of {ast.unparse(node.func)}, which returns none,")
        return value

    def _call(self, node: ast.Call) -> Any:
        if node.keywords:
            raise self._refused(node, "a call with keywords")
        callee, arguments = self._callee(node.func), list(self._spread(node.args))
        name = getattr(callee, "__name__", "")
        if isinstance(callee, types.FunctionType):
            if name in self._module.linked:
                return self._call_external(node, self._module.linked[name], arguments)
            done = self._module.translated(callee, tuple(_shape(argument) for argument in arguments))
            leaves = [self._converted(node, leaf, _shape(leaf)) for leaf in _flat(tuple(arguments))]
            return self._call_symbol(done.name, done.result, leaves)
        form = getattr(self, f"_call_{name}", None)
        if form is None or callee not in _KNOWN:
            raise self._refused(node, f"a call of {ast.unparse(node.func)}")
        return form(node, *arguments)

    def _call_external(self, node: ast.Call, unit: External, arguments: list[Any]) -> Any:
        kinds = [_OF_NAME.get(kind, kind) for kind in unit.arguments]
        if len(kinds) != len(arguments):
            raise self._refused(node, f"a call with {len(arguments)} arguments for {len(kinds)}")
        leaves = [self._converted(node, value, kind) for value, kind in zip(arguments, kinds, strict=True)]
        return self._call_symbol(unit.symbol, _OF_NAME[unit.result], leaves)

    def _call_symbol(self, name: str, shape: Any, leaves: list[_Value]) -> Any:
        arguments = ", ".join(f"{_llvm(leaf.kind)} {leaf.text}" for leaf in leaves)
        call = f"call {_returned(shape)} @{name}({arguments})"
        if shape is None:
            return self._emit_plain(call)
        whole = self._emit(_returned(shape), call)
        if not isinstance(shape, tuple) or len(list(_flat(shape))) == 1:
            return _rebuilt(shape, iter([_Value(next(_flat(shape)), whole.text)]))
        parts = iter(
            [self._emit(kind, f"extractvalue {whole.kind} {whole.text}, {k}") for k, kind in enumerate(_flat(shape))]
        )
        return _rebuilt(shape, parts)

    def _call_abs(self, node: ast.Call, value: Any) -> Any:
        if isinstance(value, bool | int | float):
            return abs(value)
        if _shape(value) == FLOAT:
            return self._emit(FLOAT, f"call double @llvm.fabs.f64(double {value.text})")
        value = self._converted(node, value, INT)
        return self._emit(INT, f"call i64 @llvm.abs.i64(i64 {value.text}, i1 false)")

    def _call_sqrt(self, node: ast.Call, value: Any) -> Any:
        return self._emit(FLOAT, f"call double @llvm.sqrt.f64(double {self._converted(node, value, FLOAT).text})")

    def _call_ldexp(self, node: ast.Call, value: Any, exponent: Any) -> Any:
        mantissa, power = self._converted(node, value, FLOAT), self._converted(node, exponent, INT)
        short = self._emit("i32", f"trunc i64 {power.text} to i32")
        return self._emit(FLOAT, f"call double @ldexp(double {mantissa.text}, i32 {short.text})")

    def _call_frexp(self, node: ast.Call, value: Any) -> Any:
        place = self._new_slot("i32")
        mantissa = self._converted(node, value, FLOAT)
        part = self._emit(FLOAT, f"call double @frexp(double {mantissa.text}, ptr {place.text})")
        return part, self._emit(INT, f"sext i32 {self._loaded(place).text} to i64")

    def _call_int(self, node: ast.Call, value: Any) -> Any:
        if isinstance(value, bool | int | float):
            return int(value)
        if _shape(value) == FLOAT:
            return self._emit(INT, f"fptosi double {value.text} to i64")
        return self._converted(node, value, INT)

    def _call_float(self, node: ast.Call, value: Any) -> Any:
        return float(value) if isinstance(value, bool | int | float) else self._converted(node, value, FLOAT)

    def _call_bool(self, node: ast.Call, value: Any) -> Any:
        return self._truth(node.args[0]) if isinstance(value, bool | int | float) else self._comparison(node, ast.NotEq(), value, 0)

    def _call_max(self, node: ast.Call, *values: Any) -> Any:
        return self._extreme(node, ast.Gt(), values)

    def _call_min(self, node: ast.Call, *values: Any) -> Any:
        return self._extreme(node, ast.Lt(), values)

    def _extreme(self, node: ast.Call, sign: ast.cmpop, values: tuple[Any, ...]) -> Any:
        """Return what `min` and `max` do: a later value takes over only where it compares so, also beside a NaN."""
        if len(values) < 2:
            raise self._refused(node, "min or max of fewer than two numbers")
        shape = functools.reduce(functools.partial(self._common, node), map(_shape, values))
        best, *others = [self._converted(node, value, shape) for value in values]
        for other in others:
            test = self._comparison(node, sign, other, best)
            best = self._emit(shape, f"select i1 {test.text}, {shape} {other.text}, {shape} {best.text}")
        return best


#: What can be called besides functions of Carom.
_KNOWN = (abs, bool, float, int, max, min, math.frexp, math.ldexp, math.sqrt)


def _shape(value: Any) -> Any:
    """Return the type of a value."""
    if isinstance(value, tuple):
        return tuple(_shape(part) for part in value)
    if isinstance(value, _Value):
        return value.kind
    return BOOL if isinstance(value, bool) else INT if isinstance(value, int) else FLOAT


def _flat(value: Any) -> Iterator[Any]:
    """Yield the numbers, or the types, that a tuple of tuples is made of."""
    if isinstance(value, tuple):
        for part in value:
            yield from _flat(part)
    else:
        yield value


def _rebuilt(shape: Any, leaves: Iterator[_Value]) -> Any:
    """Undo `_flat`."""
    return tuple(_rebuilt(part, leaves) for part in shape) if isinstance(shape, tuple) else next(leaves)


def _llvm(kind: str) -> str:
    return "ptr" if kind.endswith("*") else kind


def _returned(shape: Any) -> str:
    """Return LLVM's type of a result; parts of a tuple travel side by side."""
    if shape is None:
        return "void"
    leaves = [_llvm(kind) for kind in _flat(shape)]
    return leaves[0] if len(leaves) == 1 else f"{{ {', '.join(leaves)} }}"


def _breaks(loop: ast.While) -> bool:
    """Whether a loop has a `break` of its own."""
    waiting: list[ast.AST] = list(loop.body)
    while waiting:
        node = waiting.pop()
        if isinstance(node, ast.Break):
            return True
        if not isinstance(node, ast.For | ast.While):
            waiting += ast.iter_child_nodes(node)
    return False


def _syntax(function: Any) -> ast.FunctionDef:
    """Return the syntax of a function, from the file it was read from."""
    code = function.__code__
    tree, compiled = _module_syntax(code.co_filename)
    first = code.co_firstlineno, code.co_name
    # A file changed since it was imported holds another function than the one that runs.
    if first in tree and first in compiled and _same(compiled[first], code):
        return tree[first]
    raise TranslationError(
        f"{code.co_filename}:{code.co_firstlineno}: the source of {code.co_name} is not what is running: start Python anew"
    )


def _same(one: types.CodeType, other: types.CodeType) -> bool:
    return (one.co_code, repr(one.co_consts), one.co_names) == (other.co_code, repr(other.co_consts), other.co_names)


@functools.cache
def _module_syntax(path: str) -> tuple[dict[tuple[int, str], ast.FunctionDef], dict[tuple[int, str], types.CodeType]]:
    """Return syntax and byte code of the functions of a file, by first line and name."""
    try:
        tree = ast.parse(Path(path).read_bytes(), path)
    except (OSError, SyntaxError) as error:
        raise TranslationError(f"{path}: compiling needs the source: {error}") from None
    codes = (each for each in compile(tree, path, "exec").co_consts if isinstance(each, types.CodeType))
    functions = (node for node in tree.body if isinstance(node, ast.FunctionDef))
    return (
        {(min([node.lineno, *(d.lineno for d in node.decorator_list)]), node.name): node for node in functions},
        {(each.co_firstlineno, each.co_name): each for each in codes},
    )
