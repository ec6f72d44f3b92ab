"""The rows of the kernel, as the C compiler has laid them out."""

from __future__ import annotations

import numpy as np
import pytest

from carom.trace import IMPACT_DTYPE

probe = pytest.importorskip("tests.probe")


def test_a_recorded_impact_is_a_row_of_a_trace() -> None:
    """The struct that the kernel writes has the fields of `IMPACT_DTYPE`: their order, places and types."""
    struct = probe.layouts()["Impact"]
    assert struct.itemsize == IMPACT_DTYPE.itemsize
    kinds = [(kind.base, kind.shape, place) for kind, place in (struct.fields[name] for name in struct.names)]
    assert IMPACT_DTYPE.names is not None
    assert IMPACT_DTYPE.fields is not None
    expected = [IMPACT_DTYPE.fields[name][:2] for name in IMPACT_DTYPE.names]
    assert kinds == [(kind.base, kind.shape, place) for kind, place in expected]


@pytest.mark.parametrize(("name", "size"), [("Disc", 64), ("Prediction", 32), ("Cell", 8)])
def test_rows_fill_lines_of_a_cache(name: str, size: int) -> None:
    """A disc fills a cache line of 64 bytes, and of smaller rows a whole number does, without gaps."""
    struct = probe.layouts()[name]
    assert struct.itemsize == size
    assert sum(np.dtype(struct.fields[field][0]).itemsize for field in struct.names) == size
