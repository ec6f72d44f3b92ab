"""The rows of the kernel, as the C compiler aligns them."""

from __future__ import annotations

import numpy as np
import pytest
from tests.lengths import each
from tests.stage import sure

from carom.model.trace import IMPACT_DTYPE, SPIN_DTYPE
from carom.solvers.rows import CONTACT_DTYPE

probe = pytest.importorskip("tests.probe")


@each("name, dtype", [("Impact", IMPACT_DTYPE), ("Spins", SPIN_DTYPE), ("Contact", CONTACT_DTYPE)])
def test_what_is_recorded_is_a_row_of_a_trace(name: str, dtype: np.dtype[np.void]) -> None:
    """The structs that the kernel writes have the fields of the trace's arrays: their order, places and types."""
    struct = probe.layouts()[name]
    assert struct.itemsize == dtype.itemsize
    kinds = [(kind.base, kind.shape, place) for kind, place in (struct.fields[name] for name in struct.names)]
    expected = [sure(dtype.fields)[name][:2] for name in sure(dtype.names)]
    assert kinds == [(kind.base, kind.shape, place) for kind, place in expected]


@each("name, size", [("Disc", 64), ("Prediction", 32), ("Cell", 8)])
def test_rows_fill_lines_of_a_cache(name: str, size: int) -> None:
    """A disc fills a cache line of 64 bytes, and of smaller rows a whole number does, without gaps."""
    struct = probe.layouts()[name]
    assert struct.itemsize == size
    bit_fields = 4 if name == "Prediction" else 0
    assert bit_fields + sum(np.dtype(struct.fields[field][0]).itemsize for field in struct.names) == size
