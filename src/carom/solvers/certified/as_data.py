"""Certified runs as data: plain numbers, lossless in JSON, that can be read where python-flint is not installed."""

from __future__ import annotations

import dataclasses
import math
from typing import TYPE_CHECKING, Any

import numpy as np

from carom.errors import InputError
from carom.scene import Scene
from carom.solvers.certified.result import CertifiedTrace, Degeneracy, Degenerate, Ending
from carom.trace import IMPACT_DTYPE, MODE_DTYPE, SPIN_DTYPE, Outcome, Trace

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from numpy.typing import NDArray

_FORMAT = "carom certified run, 1"
_NUMBERS = ("digits", "precision_bits", "bits_lost", "replays")
#: What a run has of rows and of its final state: in its trace, and next to it how far the truth can be from each
#: number. What is None (where nothing turns, or is in contact) is left out.
_ROWS = {"impacts": IMPACT_DTYPE, "spins": SPIN_DTYPE, "modes": MODE_DTYPE}
_FINAL = ("final_position_m", "final_velocity_m_s", "final_spin_rad_s")
_RADII = {"radii": IMPACT_DTYPE, "spin_radii": SPIN_DTYPE, "mode_radii": MODE_DTYPE}
_FINAL_RADII = ("final_position_radius_m", "final_velocity_radius_m_s", "final_spin_radius_rad_s")


def enclosures(certified: CertifiedTrace) -> dict[str, Any]:
    """Return a certified run as what JSON can hold; a number's truth is within its radius of it."""
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
        **_written(trace, _ROWS, _FINAL),
        **_written(certified, _RADII, _FINAL_RADII),
        **({} if trace.modes is None else {"mode_fields": list(MODE_DTYPE.names or ())}),
        "decimals": [list(row) for row in certified.decimals],
        "commuted": [list(pair) for pair in certified.commuted],
        **{name: getattr(certified, name) for name in _NUMBERS},
    }


def from_enclosures(document: Mapping[str, Any]) -> CertifiedTrace:
    """Return the certified run that `enclosures` wrote.

    Raises:
        InputError: It is no such document.
    """
    if document.get("format") != _FORMAT:
        raise InputError(f"format must be {_FORMAT!r}, got {document.get('format')!r}")
    trace = Trace(
        method="certified",
        scene=Scene(**document["scene"]),
        end_time_s=document["end_time_s"],
        outcome=Outcome[document["outcome"]],
        settings={"digits": document["digits"], "precision_bits": document["precision_bits"]},
        counts={"impacts": len(document["impacts"])},
        **_read(document, _ROWS, _FINAL),
    )
    trouble = document["degeneracy"]
    if trouble is not None:
        latest = math.inf if trouble["latest_s"] is None else trouble["latest_s"]
        changed = {"kind": Degenerate[trouble["kind"]], "bodies": tuple(trouble["bodies"]), "latest_s": latest}
        trouble = Degeneracy(**(trouble | changed))
    return CertifiedTrace(
        trace=trace,
        ending=Ending[document["ending"]],
        decimals=tuple(tuple(row) for row in document["decimals"]),
        degeneracy=trouble,
        commuted=tuple((a, b) for a, b in document["commuted"]),
        **{name: document[name] for name in _NUMBERS},
        **_read(document, _RADII, _FINAL_RADII),
    )


def _written(found: object, rows: Mapping[str, np.dtype[np.void]], final: Iterable[str]) -> dict[str, Any]:
    held = {name: getattr(found, name) for name in (*rows, *final)}
    return {
        name: _plain(array) if name in rows else array.tolist() for name, array in held.items() if array is not None
    }


def _read(document: Mapping[str, Any], rows: Mapping[str, np.dtype[np.void]], final: Iterable[str]) -> dict[str, Any]:
    found: dict[str, Any] = {name: _array(document[name], dtype) for name, dtype in rows.items() if name in document}
    return found | {name: np.array(document[name]) for name in final if name in document}


def _plain(rows: NDArray[np.void]) -> list[list[Any]]:
    return [[value.tolist() if isinstance(value, np.ndarray) else value for value in row] for row in rows.tolist()]


def _array(rows: list[list[Any]], dtype: np.dtype[np.void]) -> NDArray[np.void]:
    array = np.array([tuple(tuple(v) if isinstance(v, list) else v for v in row) for row in rows], dtype=dtype)
    array.flags.writeable = False
    return array
