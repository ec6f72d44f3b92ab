"""What the width of an engine's floats does to a tolerance and to a number."""

from __future__ import annotations

import numpy as np

from carom.adapter import Adapter


def width(adapter: Adapter, tolerance: float) -> float:
    """Return a tolerance that was derived from the rounding of 64-bit floats, at the width of the engine's own."""
    return tolerance * 2.0 ** {64: 0, 32: 53 - 24}[adapter.capabilities.float_bits]


def rounded(adapter: Adapter, values: object) -> object:
    """Return numbers as the engine holds them, rounded to its own width."""
    return np.array(values, dtype=f"f{adapter.capabilities.float_bits // 8}").astype(np.float64).tolist()
