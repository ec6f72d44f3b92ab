"""Object files: made by LLVM, and loaded whatever they call."""

from __future__ import annotations

import ctypes

import numpy as np
import pytest

pytest.importorskip("llvmlite")

from carom.physics import machine_code

#: A function that has LLVM call the C library, for a copy, and that calls it itself by a pointer.
COPY = """
declare void @llvm.memcpy.p0.p0.i64(ptr, ptr, i64, i1)
@copy_to_frexp = dso_local global ptr null
@copy_to_ldexp = dso_local global ptr null
define i64 @copy(ptr noalias %to, ptr noalias %from, i64 %bytes) {
  call void @llvm.memcpy.p0.p0.i64(ptr %to, ptr %from, i64 %bytes, i1 false)
  %pointer = load ptr, ptr @copy_to_ldexp
  %number = call double %pointer(double 1.5, i32 3)
  %result = fptosi double %number to i64
  ret i64 %result
}
"""


def test_code_that_calls_the_c_library_is_loaded_too() -> None:
    """Where LLVM makes calls of what is not in the module, the code is made to reach it wherever it is."""
    address = machine_code.address_of("copy", machine_code.object_file("copy", COPY), {})
    source, target = np.arange(1000.0), np.zeros(1000)
    function = ctypes.CFUNCTYPE(ctypes.c_int64, ctypes.c_void_p, ctypes.c_void_p, ctypes.c_int64)(address)
    assert function(target.ctypes.data, source.ctypes.data, source.nbytes) == 12
    assert (target == source).all()
