"""Expressions of Python as instructions."""

from __future__ import annotations

import ast
import builtins
import functools
import math
import types
from typing import TYPE_CHECKING, Any

from carom.physics.compilation import prefetch
from carom.physics.machine_code import pointer_name
from carom.physics.translation.instructions import FOLD, Instructions
from carom.physics.translation.values import (
    BOOL,
    FLOAT,
    INT,
    KINDS,
    WIDENS,
    External,
    Translated,
    Value,
    flat,
    llvm_type,
    rebuilt,
    result_type,
    shape_of,
)

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
    from typing import Protocol

    class Module(Protocol):
        """What a function must know of the module it is in."""

        symbol: str
        linked: Mapping[str, External]

        def translated(self, function: Any, shapes: tuple[Any, ...]) -> Translated:
            """Return a function for arguments of given types."""


__all__ = ["Expressions"]

#: What can be called besides functions of Carom.
_KNOWN = (abs, bool, float, int, max, min, math.frexp, math.ldexp, math.sqrt)


class Expressions(Instructions):
    """One method for each kind of expression that can be translated."""

    def __init__(self, module: Module, function: Any) -> None:
        super().__init__(function)
        self._module = module

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
        if isinstance(node.value, ast.Name) and node.value.id in self._slots:  # a part of a tuple, by its name
            slot = self._slots[node.value.id]
            if node.attr in getattr(slot, "_fields", ()):
                return self._loaded(getattr(slot, node.attr))
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
            return self._read(*self._element(node, whole, self._value(node.slice)))
        which = self._value(node.slice)
        if not isinstance(which, int) or not -len(whole) <= which < len(whole):
            raise self._refused(node, "an index into a tuple that is no constant, or beyond its end,")
        return whole[which]

    def _value_unaryop(self, node: ast.UnaryOp) -> Any:
        if isinstance(node.op, ast.Not):
            test = self._truth(node.operand)
            return not test if isinstance(test, bool) else self._emit(BOOL, f"xor i1 {test.text}, true")
        value = self._value(node.operand)
        if isinstance(value, bool | int | float) and type(node.op) in FOLD:
            return FOLD[type(node.op)](value)
        if isinstance(node.op, ast.USub) and shape_of(value) == FLOAT:
            return self._emit(FLOAT, f"fneg double {value.text}")
        if isinstance(node.op, ast.USub) and shape_of(value) in WIDENS:
            return self._emit(INT, f"sub i64 0, {self._converted(node, value, INT).text}")
        raise self._refused(node, ast.unparse(node))

    def _value_binop(self, node: ast.BinOp) -> Any:
        return self._arithmetic(node, node.op, self._value(node.left), self._value(node.right))

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

    def _value_boolop(self, node: ast.BoolOp) -> Any:
        # Only of truth values: of numbers, Python's `and` and `or` return one of the numbers.
        tests = [functools.partial(self._value, each) for each in node.values]
        return self._one_by_one(node, tests, going_on=isinstance(node.op, ast.And))

    def _one_by_one(self, node: ast.expr, tests: Sequence[Callable[[], Any]], *, going_on: bool) -> Value:
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
        shape = self._common(node, *(shape_of(value) for value, _, _ in sides))
        arrivals = []
        for value, lines, block in sides:
            self._lines, self._block, self._dead = lines, block, False
            leaves = list(flat(self._converted(node, value, shape)))
            self._jump(end)
            before += self._lines
            arrivals.append([f"[ {leaf.text}, %{block} ]" for leaf in leaves])
        self._lines = before
        self._begin(end)
        kinds = list(flat(shape))
        merged = iter(
            self._emit(kind, f"phi {llvm_type(kind)} {one}, {other}")
            for kind, one, other in zip(kinds, *arrivals, strict=True)
        )
        return rebuilt(shape, merged)

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
        if isinstance(node.func, ast.Name) and node.func.id in self._module.linked:
            return self._call_external(node, self._module.linked[node.func.id], arguments)
        if callee is prefetch:
            return self._prefetch(node, *arguments)
        if isinstance(callee, type) and issubclass(callee, tuple) and hasattr(callee, "_fields"):
            if len(callee._fields) != len(arguments):
                raise self._refused(node, f"a {name} of {len(arguments)} parts")
            return callee(*arguments)
        if isinstance(callee, types.FunctionType) and callee.__module__.startswith("carom."):
            done = self._module.translated(callee, tuple(shape_of(argument) for argument in arguments))
            leaves = [self._converted(node, leaf, shape_of(leaf)) for leaf in flat(tuple(arguments))]
            return self._call_symbol(f"@{done.name}", done.result, leaves)
        form = getattr(self, f"_call_{name}", None)
        if form is None or callee not in _KNOWN:
            raise self._refused(node, f"a call of {ast.unparse(node.func)}")
        return form(node, *arguments)

    def _call_external(self, node: ast.Call, unit: External, arguments: list[Any]) -> Any:
        kinds = [KINDS.get(kind, kind) for kind in unit.arguments]
        if len(kinds) != len(arguments):
            raise self._refused(node, f"a call with {len(arguments)} arguments for {len(kinds)}")
        leaves = [self._converted(node, value, kind) for value, kind in zip(arguments, kinds, strict=True)]
        return self._call_pointer(unit.symbol, KINDS[unit.result], leaves)

    def _call_pointer(self, name: str, shape: Any, leaves: list[Value]) -> Any:
        address = self._emit("ptr", f"load ptr, ptr @{pointer_name(self._module.symbol, name)}, !invariant.load !{{}}")
        return self._call_symbol(address.text, shape, leaves)

    def _call_symbol(self, name: str, shape: Any, leaves: list[Value]) -> Any:
        arguments = ", ".join(f"{llvm_type(leaf.kind)} {leaf.text}" for leaf in leaves)
        call = f"call {result_type(shape)} {name}({arguments})"
        if shape is None:
            return self._emit_plain(call)
        whole = self._emit(result_type(shape), call)
        if not isinstance(shape, tuple) or len(list(flat(shape))) == 1:
            return rebuilt(shape, iter([Value(next(flat(shape)), whole.text)]))
        parts = iter(
            [self._emit(kind, f"extractvalue {whole.kind} {whole.text}, {k}") for k, kind in enumerate(flat(shape))]
        )
        return rebuilt(shape, parts)

    def _prefetch(self, node: ast.AST, column: Any, index: Any) -> None:
        _, address = self._element(node, column, index)
        # To be read, into all levels of the cache, of data.
        self._emit_plain(f"call void @llvm.prefetch.p0(ptr {address}, i32 0, i32 3, i32 1)")

    def _call_abs(self, node: ast.Call, value: Any) -> Any:
        if isinstance(value, bool | int | float):
            return abs(value)
        if shape_of(value) == FLOAT:
            return self._emit(FLOAT, f"call double @llvm.fabs.f64(double {value.text})")
        value = self._converted(node, value, INT)
        return self._emit(INT, f"call i64 @llvm.abs.i64(i64 {value.text}, i1 false)")

    def _call_sqrt(self, node: ast.Call, value: Any) -> Any:
        return self._emit(FLOAT, f"call double @llvm.sqrt.f64(double {self._converted(node, value, FLOAT).text})")

    def _call_ldexp(self, node: ast.Call, value: Any, exponent: Any) -> Any:
        mantissa, power = self._converted(node, value, FLOAT), self._converted(node, exponent, INT)
        short = self._emit("i32", f"trunc i64 {power.text} to i32")
        return self._call_pointer("ldexp", FLOAT, [mantissa, short])

    def _call_frexp(self, node: ast.Call, value: Any) -> Any:
        place = self._new_slot("i32")
        part = self._call_pointer("frexp", FLOAT, [self._converted(node, value, FLOAT), Value("ptr", place.text)])
        return part, self._emit(INT, f"sext i32 {self._loaded(place).text} to i64")

    def _call_int(self, node: ast.Call, value: Any) -> Any:
        if isinstance(value, bool | int | float):
            return int(value)
        if shape_of(value) == FLOAT:
            return self._emit(INT, f"fptosi double {value.text} to i64")
        return self._converted(node, value, INT)

    def _call_float(self, node: ast.Call, value: Any) -> Any:
        return float(value) if isinstance(value, bool | int | float) else self._converted(node, value, FLOAT)

    def _call_bool(self, node: ast.Call, value: Any) -> Any:
        return self._truth_of(node, value)

    def _call_max(self, node: ast.Call, *values: Any) -> Any:
        return self._extreme(node, ast.Gt(), values)

    def _call_min(self, node: ast.Call, *values: Any) -> Any:
        return self._extreme(node, ast.Lt(), values)

    def _extreme(self, node: ast.Call, sign: ast.cmpop, values: tuple[Any, ...]) -> Any:
        """Return what `min` and `max` do: a later value takes over only where it compares so, also beside a NaN."""
        if len(values) < 2:
            raise self._refused(node, "min or max of fewer than two numbers")
        shape = functools.reduce(functools.partial(self._common, node), map(shape_of, values))
        best, *others = [self._converted(node, value, shape) for value in values]
        for other in others:
            test = self._comparison(node, sign, other, best)
            best = self._emit(shape, f"select i1 {test.text}, {shape} {other.text}, {shape} {best.text}")
        return best

    def _truth(self, node: ast.expr) -> bool | Value:
        """Return whether an expression counts as true."""
        return self._truth_of(node, self._value(node))
