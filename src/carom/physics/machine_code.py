"""LLVM's part in compiling: from its intermediate representation to an object file, and from that into this process."""

from __future__ import annotations

import ctypes
import functools
from typing import Any

__all__ = ["LIBRARY", "address_of", "object_file", "pointer_name", "target_name"]

#: Functions of the C library that a unit may call.
LIBRARY = ("frexp", "ldexp")

#: What LLVM may make calls of the C library of; every module has a `memset` of its own.
_COPIES = ("llvm.memcpy", "llvm.memmove")

#: Full optimisation. What may be optimised away is fixed by the code alone: none of its operations carries a flag that
#: would let LLVM contract or reorder floats.
_LEVEL = 3


def target_name() -> str:
    """Return all of this machine and of LLVM that an object file hangs on."""
    import llvmlite  # type: ignore[import-untyped] # it has no annotations
    import llvmlite.binding as llvm  # type: ignore[import-untyped]

    parts = (llvmlite.__version__, llvm.llvm_version_info, llvm.get_process_triple(), llvm.get_host_cpu_name())
    return " ".join(map(str, (*parts, llvm.get_host_cpu_features().flatten())))


def object_file(symbol: str, *codes: str, vectors: bool = False) -> bytes:
    """Return modules of LLVM's intermediate representation, linked together, as an object file for this machine.

    Args:
        symbol: The function for whose sake it is made. Nothing else can be found in it but the pointers by which that
            calls other units and the C library.
        codes: The modules.
        vectors: Whether several passes of a loop may be taken at a time. The kernel is some 3 % faster without, and
            1 % without vectors of straight code, which none has.
    """
    import llvmlite.binding as llvm

    machine = _machine(near=True)
    module, *others = map(llvm.parse_assembly, codes)
    for each in (module, *others):
        each.triple, each.data_layout = llvm.get_process_triple(), str(machine.target_data)
    for each in others:
        module.link_in(each)
    for each in (*module.functions, *module.global_variables):
        if not (each.is_declaration or each.name.startswith((symbol, "llvm."))):
            each.linkage = llvm.Linkage.internal
    module.verify()
    options = llvm.create_pipeline_tuning_options(speed_level=_LEVEL)
    options.loop_vectorization, options.slp_vectorization = vectors, False
    builder = llvm.create_pass_builder(machine, options)
    builder.getModulePassManager().run(module, builder)
    declared = [each.name for each in module.functions if each.is_declaration]
    if any(name.startswith(_COPIES) or not name.startswith("llvm.") for name in declared):
        machine = _machine(near=False)
    emitted: bytes = machine.emit_object(module)
    return emitted


def pointer_name(symbol: str, called: str) -> str:
    """Return the name of the variable that holds where the unit `symbol` finds another function."""
    return f"{symbol}_to_{called}"


def address_of(symbol: str, emitted: bytes, linked: dict[str, int]) -> int:
    """Load an object file into this process, for good, and return the address of a function in it.

    Args:
        symbol: The function.
        emitted: The object file.
        linked: Addresses of the units that it calls, by symbol.
    """
    import llvmlite.binding as llvm

    engine = _engine()
    engine.add_object_file(llvm.ObjectFileRef.from_data(emitted))
    engine.finalize_object()
    called = {name: llvm.address_of_symbol(name) for name in LIBRARY} | linked
    for name, address in called.items():
        pointer = engine.get_global_value_address(pointer_name(symbol, name))
        ctypes.c_void_p.from_address(pointer).value = address
    found: int = engine.get_function_address(symbol)
    return found


def _machine(*, near: bool) -> Any:
    """Return LLVM's description of this machine, for code that is loaded anywhere in the address space.

    Args:
        near: Everything that the code names lies beside it. Constants addressed relative to the code make the kernel
            some 6 % faster than 64-bit addresses do, which LLVM otherwise takes for code made at run time.
    """
    import llvmlite.binding as llvm

    llvm.initialize_native_target()
    llvm.initialize_native_asmprinter()
    target = llvm.Target.from_triple(llvm.get_process_triple())
    # The relocations of far code are those that numba chooses: static on x86, the default on others.
    far = {"reloc": "static" if target.name.startswith("x86") else "default", "jit": True}
    model = {"reloc": "pic", "codemodel": "small"} if near and _in_one_block() else far
    features = llvm.get_host_cpu_features().flatten()
    return target.create_target_machine(llvm.get_host_cpu_name(), features, _LEVEL, **model)


def _in_one_block() -> bool:
    """Whether all sections of an object file are loaded side by side."""
    import llvmlite.binding as llvm

    return bool(llvm.get_process_triple().startswith("x86_64") and llvm.get_object_format() == "ELF")


@functools.cache
def _engine() -> Any:
    import llvmlite.binding as llvm

    # llvmlite's own memory manager sets aside one block for an object file. In near code it has no room for calls of
    # anything outside, but there are none: units call each other by pointers.
    code, options = llvm.parse_assembly(""), {"use_lmm": True} if _in_one_block() else {}
    return llvm.create_mcjit_compiler(code, _machine(near=False), **options)
