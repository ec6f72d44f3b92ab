"""Functions in LLVM's intermediate representation: numba's part in compiling."""

from __future__ import annotations

import functools
from types import FunctionType
from typing import TYPE_CHECKING, Any

from carom.physics.machine_code import LIBRARY, pointer_name

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

__all__ = ["External", "lowered"]

External = tuple[str, str, tuple[str, ...]]
"""A function outside the module: its symbol, the type of its result, and those of its arguments."""

#: LLVM's names of the types of results and arguments.
_KINDS = {"float64": "double", "int64": "i64"}

#: What numba calls the functions of the C library, and their types; and what LLVM makes calls of where a loop clears an
#: array: with one in the module, nothing outside is called.
_PRELUDE = """
define double @numba_frexp(double %x, ptr %exponent) nounwind alwaysinline {{
  %to = load ptr, ptr @{frexp}, !invariant.load !{{}}
  %r = call double %to(double %x, ptr %exponent)
  ret double %r
}}
define double @numba_ldexp(double %x, i32 %exponent) nounwind alwaysinline {{
  %to = load ptr, ptr @{ldexp}, !invariant.load !{{}}
  %r = call double %to(double %x, i32 %exponent)
  ret double %r
}}
define double @sqrt(double %x) nounwind alwaysinline {{
  %r = call double @llvm.sqrt.f64(double %x)
  ret double %r
}}
declare double @llvm.sqrt.f64(double)
@llvm.compiler.used = appending global [1 x ptr] [ptr @memset]
define ptr @memset(ptr %to, i32 %value, i64 %count) nounwind noinline "no-builtins" {{
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
}}
"""

_OPTIONS = {
    "nogil": True,
    "fastmath": False,
    "error_model": "numpy",  # a division by zero gives what IEEE 754 says, and raises nothing
    "_nrt": False,  # nothing is allocated
    # Only what is made here calls them: no need for the ways in from Python and C.
    "no_cpython_wrapper": True,
    "no_cfunc_wrapper": True,
}


def lowered(
    functions: Sequence[Callable[..., Any]],
    symbol: str,
    result: str,
    arguments: tuple[str, ...],
    linked: Mapping[str, External],
) -> tuple[str, str]:
    """Return two modules of LLVM's intermediate representation, to be linked: numba's, and what makes a unit of it.

    Args:
        functions: The function and those that it calls, directly or not; the function first.
        symbol: What it is to be called in machine code.
        result: Type of its result, "float64" or "int64".
        arguments: Types of its arguments; "float64*" is a pointer into an array.
        linked: Functions that are called by pointers, which the loader sets, by their names in the source.
    """
    import llvmlite.binding as llvm  # type: ignore[import-untyped] # it has no annotations
    import numba

    for external, _, _ in linked.values():
        llvm.add_symbol(external, 1)  # numba loads what it compiles, so it looks for what that calls; it is never run
    njit: Any = numba.njit  # its annotations are incomplete
    done: dict[str, Any] = {
        name: numba.types.ExternalFunction(external, _numba_type(kind)(*map(_numba_type, kinds)))
        for name, (external, kind, kinds) in linked.items()
    }
    copies = []
    for function in functions:
        copy = FunctionType(function.__code__, dict(function.__globals__), function.__name__)
        copy.__module__ = function.__module__
        copies.append(copy)
        if function.__name__ == "prefetch":
            done["prefetch"] = _prefetch()
        else:
            inline = function in function.__globals__.get("INLINE", ())  # what its module says costs less than a call
            done[function.__name__] = _for_any_value(njit(**_OPTIONS, forceinline=inline)(copy))
    for copy in copies:
        copy.__globals__.update(done)
    whole = done[functions[0].__name__]
    signature = _numba_type(result)(*map(_numba_type, arguments))
    whole.compile(signature)
    code: str = whole.inspect_llvm(signature.args)
    return code, _unit(whole.overloads[signature.args].fndesc.llvm_func_name, symbol, result, arguments, linked)


def _for_any_value(function: Any) -> Any:
    """Return numba's function, made to compile no copy of itself for each number that stands in a call of it."""
    from numba.core.types import unliteral

    template = function.get_call_template
    function.get_call_template = lambda given, named: template([unliteral(each) for each in given], named)
    return function


def _unit(
    name: str, symbol: str, result: str, arguments: tuple[str, ...], linked: Mapping[str, External]
) -> str:
    """Return the way into numba's function as a C function, and the ways out of it."""
    called = (*LIBRARY, *(external for external, _, _ in linked.values()))
    texts = [f"@{pointer_name(symbol, other)} = dso_local global ptr null" for other in called]
    texts.append(_PRELUDE.format(**{other: pointer_name(symbol, other) for other in LIBRARY}))
    for external, kind, kinds in linked.values():
        result_kind, parameters, passed = _signature(kind, kinds)
        texts.append(
            f"define {result_kind} @{external}({parameters}) nounwind alwaysinline {{\n"
            f"  %to = load ptr, ptr @{pointer_name(symbol, external)}, !invariant.load !{{}}\n"
            f"  %r = call {result_kind} %to({passed})\n  ret {result_kind} %r\n}}"
        )
    result_kind, parameters, passed = _signature(result, arguments)
    texts.append(
        f"declare i32 @{name}(ptr, ptr, {parameters})\n"
        # The kernel is some 2 % faster where a write to one column is known to leave the others as they are.
        f"define {result_kind} @{symbol}({parameters.replace('ptr', 'ptr noalias')}) nounwind {{\n"
        f"  %to = alloca {result_kind}\n  %error = alloca ptr\n"
        f"  call i32 @{name}(ptr %to, ptr %error, {passed}) alwaysinline\n"
        f"  %r = load {result_kind}, ptr %to\n  ret {result_kind} %r\n}}"
    )
    return "\n".join(texts)


def _signature(result: str, arguments: tuple[str, ...]) -> tuple[str, str, str]:
    """Return in LLVM's terms the type of a result, and arguments as they are declared and as they are passed."""
    kinds = ["ptr" if name.endswith("*") else _KINDS[name] for name in arguments]
    named = ", ".join(f"{kind} %a{k}" for k, kind in enumerate(kinds))
    return _KINDS[result], named, named


def _numba_type(name: str) -> Any:
    import numba

    kind = getattr(numba.types, name.rstrip("*"))
    return numba.types.CPointer(kind) if name.endswith("*") else kind


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
