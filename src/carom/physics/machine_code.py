"""LLVM's part in compiling: from its intermediate representation to an object file, and from that into this process."""

from __future__ import annotations

import functools
from typing import Any

__all__ = ["address_of", "object_file", "target_name"]

#: Full optimisation. What may be optimised away is fixed by the code alone: none of its operations carries a flag that
#: would let LLVM contract or reorder floats.
_LEVEL = 3


def target_name() -> str:
    """Return all of this machine and of LLVM that an object file hangs on."""
    import llvmlite  # type: ignore[import-untyped] # it has no annotations
    import llvmlite.binding as llvm  # type: ignore[import-untyped]

    parts = (llvmlite.__version__, llvm.llvm_version_info, llvm.get_process_triple(), llvm.get_host_cpu_name())
    return " ".join(map(str, (*parts, llvm.get_host_cpu_features().flatten())))


def object_file(code: str) -> bytes:
    """Return a module of LLVM's intermediate representation as an object file for this machine."""
    import llvmlite.binding as llvm

    machine = _machine()
    module = llvm.parse_assembly(code)
    module.triple, module.data_layout = llvm.get_process_triple(), str(machine.target_data)
    module.verify()
    options = llvm.create_pipeline_tuning_options(speed_level=_LEVEL)
    options.loop_vectorization, options.slp_vectorization = True, False
    builder = llvm.create_pass_builder(machine, options)
    builder.getModulePassManager().run(module, builder)
    emitted: bytes = machine.emit_object(module)
    return emitted


def address_of(symbol: str, emitted: bytes, linked: dict[str, int]) -> int:
    """Load an object file into this process, for good, and return the address of a function in it.

    Args:
        symbol: The function.
        emitted: The object file.
        linked: Addresses of what the object file calls, by symbol.
    """
    import llvmlite.binding as llvm

    for name, address in linked.items():
        llvm.add_symbol(name, address)
    engine = _engine()
    engine.add_object_file(llvm.ObjectFileRef.from_data(emitted))
    engine.finalize_object()
    found: int = engine.get_function_address(symbol)
    return found


def _machine() -> Any:
    """Return LLVM's description of this machine, for code that is loaded anywhere in the address space."""
    import llvmlite.binding as llvm

    llvm.initialize_native_target()
    llvm.initialize_native_asmprinter()
    target = llvm.Target.from_triple(llvm.get_process_triple())
    # As numba does: RuntimeDyld relocates x86 code only in the static model, and jit=True asks for 64-bit addresses.
    reloc = "static" if target.name.startswith("x86") else "default"
    features = llvm.get_host_cpu_features().flatten()
    return target.create_target_machine(
        llvm.get_host_cpu_name(), features, _LEVEL, reloc=reloc, codemodel="jitdefault", jit=True
    )


@functools.cache
def _engine() -> Any:
    import llvmlite.binding as llvm

    return llvm.create_mcjit_compiler(llvm.parse_assembly(""), _machine())
