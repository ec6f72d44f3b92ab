"""Statements of Python as instructions: a whole function."""

from __future__ import annotations

import ast
from typing import TYPE_CHECKING, Any

from carom.physics.translation.expressions import Expressions
from carom.physics.translation.syntax import syntax_of
from carom.physics.translation.values import BOOL, INT, Value, flat, llvm_type, result_type, shape_of, tuple_like

if TYPE_CHECKING:
    from collections.abc import Sequence

    from carom.physics.translation.expressions import Module

__all__ = ["Function"]


class Function(Expressions):
    """A function translated for arguments of given types; one method for each kind of statement.

    Attributes:
        name: Its name in the module.
        result: Type of its result, None where it returns nothing.
        text: Its definition.
    """

    def __init__(self, module: Module, function: Any, shapes: tuple[Any, ...], name: str) -> None:
        super().__init__(module, function)
        self.name, self.result = name, None
        self._returns: list[tuple[int, ast.Return | None, Any]] = []
        self._loops: list[tuple[str, str]] = []  # where `continue` and `break` lead
        self._leaves: list[Value] = []
        node = syntax_of(function)
        parameters = [each.arg for each in node.args.args]
        if len(parameters) != len(shapes):
            raise self._refused(node, f"a call with {len(shapes)} arguments for {len(parameters)}")
        for parameter, shape in zip(parameters, shapes, strict=True):
            self._store_name(node, parameter, self._parameter(shape))
        self._run(node.body)
        if not self._dead:
            self._return(None)
        self._finish(node)
        inline = function in function.__globals__.get("INLINE", ())  # what its module says costs less than a call
        attributes = "alwaysinline nounwind" if inline else "nounwind"
        signature = ", ".join(f"{llvm_type(leaf.kind)} {leaf.text}" for leaf in self._leaves)
        lines = "\n  ".join(["entry:", *self._entry, *self._lines])
        self.text = f"define internal {result_type(self.result)} @{name}({signature}) {attributes} {{\n{lines}\n}}\n"

    def _parameter(self, shape: Any) -> Any:
        if isinstance(shape, tuple):
            return tuple_like(shape, map(self._parameter, shape))
        self._leaves.append(Value(shape, f"%p{len(self._leaves)}"))
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
        shape = shape_of(values[0])
        for _, where, value in self._returns:
            if value is None:
                raise self._refused(where or node, "a function that returns a number here and none there")
            shape = self._common(where or node, shape, shape_of(value))
        self.result = shape
        for place, _, value in self._returns:
            following, self._lines = self._lines, []
            leaves = list(flat(self._converted(node, value, shape)))
            whole, kind = leaves[0], result_type(shape)
            if len(leaves) > 1:
                text = "poison"
                for k, leaf in enumerate(leaves):
                    text = self._emit(kind, f"insertvalue {kind} {text}, {leaf.kind} {leaf.text}, {k}").text
                whole = Value(kind, text)
            self._emit_plain(f"ret {kind} {whole.text}")
            following[place] = "\n  ".join(self._lines)
            self._lines = following

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
            column, address = self._place(target)
            self._write(target, column, address, value)
        elif isinstance(target, ast.Tuple) and isinstance(value, tuple) and len(target.elts) == len(value):
            for part, each in zip(target.elts, value, strict=True):
                self._assign(part, each)
        else:
            raise self._refused(target, f"an assignment of {shape_of(value)} to {ast.unparse(target)}")

    def _place(self, target: ast.Subscript) -> tuple[str, str]:
        return self._element(target, self._value(target.value), self._value(target.slice))

    def _run_augassign(self, node: ast.AugAssign) -> None:
        if isinstance(node.target, ast.Subscript):
            column, address = self._place(node.target)
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
            self._assign(node.target, part)
            self._jump(body)
            self._loop(node, body, following, end)
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

    def _run_continue(self, _node: ast.Continue) -> None:
        self._jump(self._loops[-1][0])

    def _run_break(self, _node: ast.Break) -> None:
        self._jump(self._loops[-1][1])

    def _run_return(self, node: ast.Return) -> None:
        self._return(node)

    def _return(self, node: ast.Return | None) -> None:
        value = None if node is None or node.value is None else self._value(node.value)
        self._returns.append((len(self._lines), node, value))
        self._lines.append("")
        self._dead = True


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
