"""Exact conversion of certified runs to JSON values, which can be read without python-flint."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from carom.model.trace import IMPACT_DTYPE, MODE_DTYPE, SPIN_DTYPE
from carom.solvers.certified.result import CertifiedTrace

_FORMAT = "carom certified run, 1"
NUMBERS = ("digits", "precision_bits", "bits_lost", "replays")
#: Fields of the trace that are written: arrays with their types, and the final state. Fields with None are omitted.
ROWS = {"impacts": IMPACT_DTYPE, "spins": SPIN_DTYPE, "modes": MODE_DTYPE}
FINAL = ("final_position_m", "final_velocity_m_s", "final_spin_rad_s")
RADII = {"radii": IMPACT_DTYPE, "spin_radii": SPIN_DTYPE, "mode_radii": MODE_DTYPE}
FINAL_RADII = ("final_position_radius_m", "final_velocity_radius_m_s", "final_spin_radius_rad_s")


def enclosures(certified: CertifiedTrace) -> dict[str, Any]:
    """Return a certified run as JSON values, with the error bound of each number."""
    trace, degeneracy = certified.trace, certified.degeneracy
    trouble = degeneracy and dataclasses.asdict(degeneracy)
    if degeneracy and trouble:
        latest = None if math.isinf(degeneracy.latest_s) else degeneracy.latest_s
        trouble |= {"kind": degeneracy.kind.name, "bodies": list(degeneracy.bodies), "latest_s": latest}
    return {
        "format": _FORMAT,
        "scene": trace.scene.model_dump(mode="json"),
        "ending": certified.ending.name,
        "outcome": trace.outcome.name,
        "degeneracy": trouble,
        "end_time_s": trace.end_time_s,
        "fields": list(IMPACT_DTYPE.names or ()),
        **_write_fields(trace, ROWS, FINAL),
        **_write_fields(certified, RADII, FINAL_RADII),
        **({} if trace.modes is None else {"mode_fields": list(MODE_DTYPE.names or ())}),
        "decimals": [list(row) for row in certified.decimals],
        "commuted": [list(pair) for pair in certified.commuted],
        **{name: getattr(certified, name) for name in NUMBERS},
    }


def _write_fields(owner: object, rows: Mapping[str, np.dtype[np.void]], final: Iterable[str]) -> dict[str, Any]:
    arrays = {name: getattr(owner, name) for name in (*rows, *final)}
    return {
        name: _write_rows(array) if name in rows else array.tolist()
        for name, array in arrays.items()
        if array is not None
    }


def _write_rows(rows: NDArray[np.void]) -> list[list[Any]]:
    return [[value.tolist() if isinstance(value, np.ndarray) else value for value in row] for row in rows.tolist()]
