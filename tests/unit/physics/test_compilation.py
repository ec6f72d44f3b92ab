"""Compiled units: what they are made of, when they are used, and that nothing needs them."""

from __future__ import annotations

import subprocess
import sys

import numpy as np
import pytest

from carom.bench.time_of_impact import pairs_of_class
from carom.physics import time_of_impact as module
from carom.physics.compilation import compiled_unit

WITHOUT_NUMBA = """
import math, sys
sys.modules["llvmlite"] = None          # importing it fails, as where it is not installed
import importlib.util
found = importlib.util.find_spec
importlib.util.find_spec = lambda name, *rest: None if name == "llvmlite" else found(name, *rest)
import numpy as np
import carom
from carom.bench.gas import hard_disc_gas
from carom.solvers.event_driven import EventDrivenRun
run = EventDrivenRun(hard_disc_gas(400, 0.3))
run.advance_to(math.inf, 5)
assert run.impacts == 5 and "llvmlite is not installed" in run.notes[0], run.notes
p = np.tile([0.0, 0.0], (5, 1))
assert (carom.time_of_impact(p, [1.0, 0.0], 0.5, [3.0, 0.0], [0.0, 0.0], 0.5) == 2.0).all()
try:
    EventDrivenRun(hard_disc_gas(9, 0.3), compiled=True)
except carom.CaromError as error:
    assert "carom[fast]" in str(error)
else:
    raise SystemExit("a compiled run without llvmlite was not refused")
"""


def test_everything_runs_where_llvmlite_is_not_installed() -> None:
    """Without llvmlite many discs run as plain Python, which the run says; a compiled run is refused with the remedy."""
    subprocess.run([sys.executable, "-c", WITHOUT_NUMBA], check=True)


def test_large_arrays_are_compiled_once_that_pays(monkeypatch: pytest.MonkeyPatch) -> None:
    """From a number of elements on the array form is the compiled one, with the same bits."""
    pytest.importorskip("llvmlite")
    columns = pairs_of_class("as they come", 500, 4)
    expected = module.pair_times(*columns, compiled=False)
    module._compiled_fill.cache_clear()  # noqa: SLF001 - which of two forms of the same bits was taken shows here only
    monkeypatch.setattr(module, "COMPILED_FROM", 501)
    module.pair_times(*columns)
    assert not module._is_loaded()  # noqa: SLF001
    monkeypatch.setattr(module, "COMPILED_FROM", 500)
    assert module.pair_times(*columns).tobytes() == expected.tobytes()
    assert module._is_loaded()  # noqa: SLF001


def leaf(x: float) -> float:
    """Return a quarter of `x`."""
    return 0.25 * x


def total(values: np.ndarray, count: int) -> float:
    """Return the sum of a quarter of each value."""
    result = 0.0
    for k in range(count):
        result += leaf(values[k])
    return result


def test_a_unit_is_named_after_all_the_code_that_went_into_it(monkeypatch: pytest.MonkeyPatch) -> None:
    """A changed callee makes another unit, so that no stale machine code is ever taken from the cache."""
    pytest.importorskip("llvmlite")
    monkeypatch.setitem(sys.modules, "carom.example", sys.modules[__name__])
    monkeypatch.setattr(leaf, "__module__", "carom.example")
    before = compiled_unit.__wrapped__(total, "float64", ("float64*", "int64"))
    monkeypatch.setattr(leaf, "__code__", (lambda x: 0.5 * x).__code__)
    after = compiled_unit.__wrapped__(total, "float64", ("float64*", "int64"))
    assert before.symbol != after.symbol
