"""Functions in LLVM's intermediate representation: numba's part in compiling, as a process of its own.

It reads one unit from its input, as `Request` says, and writes two modules. So numba, which takes a second to load, and
the settings that it is told here never touch the process that wants the unit; and several units are made at once.
"""

from __future__ import annotations

import functools
import gc
import importlib
import marshal
import sys
from collections import namedtuple
from types import CodeType, FunctionType
from typing import Any, NamedTuple

from carom.physics.machine_code import LIBRARY, pointer_name

__all__ = ["External", "Request", "Source", "lowered", "main"]


class External(NamedTuple):
    """A function outside the module.

    Attributes:
        name: What the source calls it.
        symbol: What machine code calls it.
        result: Type of its result.
        arguments: Types of its arguments.
    """

    name: str
    symbol: str
    result: str
    arguments: tuple[str, ...]


class Source(NamedTuple):
    """A function, in parts that can be sent.

    Attributes:
        code: Its byte code.
        module: Where it was defined.
        numbers: Numbers that it finds by name.
        tuples: Names and fields of the named tuples that it finds by name.
        modules: Modules that it finds by name, and theirs.
        inline: Whether its code takes the place of each call.
    """

    code: CodeType
    module: str
    numbers: tuple[tuple[str, float], ...]
    tuples: tuple[tuple[str, tuple[str, ...]], ...]
    modules: tuple[tuple[str, str], ...]
    inline: bool


class Request(NamedTuple):
    """What makes a unit.

    Attributes:
        symbol: What it is to be called in machine code.
        result: Type of its result, "float64" or "int64".
        arguments: Types of its arguments; "float64*" is a pointer into an array.
        sources: Its function, and those that it calls, directly or not.
        linked: Functions that are called by pointers, which the loader sets.
    """

    symbol: str
    result: str
    arguments: tuple[str, ...]
    sources: tuple[Source, ...]
    linked: tuple[External, ...]


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


def main() -> None:
    """Answer one request."""
    gc.disable()  # it takes a twentieth of the time, and finds little
    answer, sys.stdout = sys.stdout.buffer, sys.stderr
    symbol, result, arguments, sources, linked = marshal.load(sys.stdin.buffer)  # noqa: S302 - of the parent process
    request = Request(
        symbol, result, arguments, tuple(Source(*each) for each in sources), tuple(External(*each) for each in linked)
    )
    answer.write(marshal.dumps(lowered(request)))


def lowered(request: Request) -> tuple[str, str]:
    """Return two modules of LLVM's intermediate representation, to be linked: numba's, and what makes a unit of it."""
    import llvmlite.binding as llvm  # type: ignore[import-untyped] # it has no annotations
    import numba

    njit: Any = numba.njit  # its annotations are incomplete
    done: dict[str, Any] = {}
    for each in request.linked:
        llvm.add_symbol(
            each.symbol, 1
        )  # numba loads what it compiles, so it looks for what that calls; it is never run
        signature = _numba_type(each.result)(*map(_numba_type, each.arguments))
        done[each.name] = numba.types.ExternalFunction(each.symbol, signature)
    functions = {source.code.co_name: _function(source) for source in request.sources}
    for source, (name, function) in zip(request.sources, functions.items(), strict=True):
        if name == "prefetch":
            done[name] = _prefetch()
        else:
            done[name] = njit(**_OPTIONS, forceinline=source.inline)(function)
    for function in functions.values():
        function.__globals__.update(done)
    whole = done[request.sources[0].code.co_name]
    signature = _numba_type(request.result)(*map(_numba_type, request.arguments))
    whole.compile(signature)
    code: str = whole.inspect_llvm(signature.args)
    return code, _unit(whole.overloads[signature.args].fndesc.llvm_func_name, request)


def _function(source: Source) -> FunctionType:
    names: dict[str, Any] = {"__name__": source.module, **dict(source.numbers)}
    names |= {name: _named_tuple(name, fields) for name, fields in source.tuples}
    names |= {name: importlib.import_module(module) for name, module in source.modules}
    return FunctionType(source.code, names, source.code.co_name)


@functools.cache
def _named_tuple(name: str, fields: tuple[str, ...]) -> Any:
    return namedtuple(name, fields)


def _unit(name: str, request: Request) -> str:
    """Return the way into numba's function as a C function, and the ways out of it."""
    symbol, pointers = request.symbol, {other: pointer_name(request.symbol, other) for other in LIBRARY}
    pointers |= {each.symbol: pointer_name(symbol, each.symbol) for each in request.linked}
    texts = [f"@{pointer} = dso_local global ptr null" for pointer in pointers.values()]
    texts.append(_PRELUDE.format(**{other: pointers[other] for other in LIBRARY}))
    for each in request.linked:
        result, declared = _c_types(each.result, each.arguments)
        texts.append(
            f"define {result} @{each.symbol}({declared}) nounwind alwaysinline {{\n"
            f"  %to = load ptr, ptr @{pointers[each.symbol]}, !invariant.load !{{}}\n"
            f"  %r = call {result} %to({declared})\n  ret {result} %r\n}}"
        )
    result, declared = _c_types(request.result, request.arguments)
    texts.append(
        f"declare i32 @{name}(ptr, ptr, {declared})\n"
        # The kernel is some 1 % faster where a write to one column is known to leave the others as they are.
        f"define {result} @{symbol}({declared.replace('ptr', 'ptr noalias')}) nounwind {{\n"
        f"  %to = alloca {result}\n  %error = alloca ptr\n"
        f"  call i32 @{name}(ptr %to, ptr %error, {declared}) alwaysinline\n"
        f"  %r = load {result}, ptr %to\n  ret {result} %r\n}}"
    )
    return "\n".join(texts)


def _c_types(result: str, arguments: tuple[str, ...]) -> tuple[str, str]:
    """Return LLVM's types of a result and of arguments, these with names."""
    kinds = ["ptr" if name.endswith("*") else _KINDS[name] for name in arguments]
    return _KINDS[result], ", ".join(f"{kind} %a{k}" for k, kind in enumerate(kinds))


def _numba_type(name: str) -> Any:
    import numba

    types: Any = numba.types
    kind = getattr(types, name.rstrip("*"))
    return types.CPointer(kind) if name.endswith("*") else kind


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


if __name__ == "__main__":
    main()
