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
    from collections.abc import Mapping

    from numpy.typing import NDArray

_FORMAT = "carom certified run, 1"
#: Fields of a trace, and of a certified one, that are the same in both.
_FINAL = ("final_position_m", "final_velocity_m_s")
_FINAL_RADII = ("final_position_radius_m", "final_velocity_radius_m_s")
_NUMBERS = ("digits", "precision_bits", "bits_lost", "replays")


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
        "impacts": _plain(trace.impacts),
        "radii": _plain(certified.radii),
        "decimals": [list(row) for row in certified.decimals],
        "commuted": [list(pair) for pair in certified.commuted],
        **{name: getattr(trace, name).tolist() for name in _FINAL},
        **{name: getattr(certified, name).tolist() for name in _FINAL_RADII},
        **{name: getattr(certified, name) for name in _NUMBERS},
        **_turning(certified),
        **_in_contact(certified),
    }


def from_enclosures(document: Mapping[str, Any]) -> CertifiedTrace:
    """Return the certified run that `enclosures` wrote.

    Raises:
        InputError: It is no such document.
    """
    if document.get("format") != _FORMAT:
        raise InputError(f"format must be {_FORMAT!r}, got {document.get('format')!r}")
    final: dict[str, Any] = {name: np.array(document[name]) for name in _FINAL}
    same: dict[str, Any] = {name: document[name] for name in _NUMBERS}
    same |= {name: np.array(document[name]) for name in _FINAL_RADII}
    trace = Trace(
        method="certified",
        scene=Scene(**document["scene"]),
        impacts=_array(document["impacts"]),
        end_time_s=document["end_time_s"],
        outcome=Outcome[document["outcome"]],
        settings={"digits": document["digits"], "precision_bits": document["precision_bits"]},
        counts={"impacts": len(document["impacts"])},
        modes=_modes(document, "modes"),
        **final,
        **_read(document, "spins", "final_spin_rad_s"),
    )
    trouble = document["degeneracy"]
    if trouble is not None:
        latest = math.inf if trouble["latest_s"] is None else trouble["latest_s"]
        changed = {"kind": Degenerate[trouble["kind"]], "bodies": tuple(trouble["bodies"]), "latest_s": latest}
        trouble = Degeneracy(**(trouble | changed))
    return CertifiedTrace(
        trace=trace,
        radii=_array(document["radii"]),
        ending=Ending[document["ending"]],
        decimals=tuple(tuple(row) for row in document["decimals"]),
        degeneracy=trouble,
        commuted=tuple((a, b) for a, b in document["commuted"]),
        **same,
        mode_radii=_modes(document, "mode_radii"),
        **_read(document, "spin_radii", "final_spin_radius_rad_s"),
    )


def _turning(certified: CertifiedTrace) -> dict[str, Any]:
    """Return what there is in a scene in which something turns."""
    trace = certified.trace
    if trace.spins is None or certified.spin_radii is None:
        return {}
    final = {"final_spin_rad_s": trace.final_spin_rad_s, "final_spin_radius_rad_s": certified.final_spin_radius_rad_s}
    return {
        "spins": _plain(trace.spins),
        "spin_radii": _plain(certified.spin_radii),
        **{name: spin.tolist() for name, spin in final.items() if spin is not None},
    }


def _in_contact(certified: CertifiedTrace) -> dict[str, Any]:
    """Return what there is where discs are in contact with walls."""
    if certified.trace.modes is None or certified.mode_radii is None:
        return {}
    fields = list(MODE_DTYPE.names or ())
    return {
        "mode_fields": fields,
        "modes": _plain(certified.trace.modes),
        "mode_radii": _plain(certified.mode_radii),
    }


def _modes(document: Mapping[str, Any], rows: str) -> NDArray[np.void] | None:
    return _array(document[rows], MODE_DTYPE) if rows in document else None


def _read(document: Mapping[str, Any], rows: str, final: str) -> dict[str, Any]:
    if rows not in document:
        return {}
    spins = np.array([tuple(row) for row in document[rows]], dtype=SPIN_DTYPE)
    spins.flags.writeable = False
    return {rows: spins, final: np.array(document[final])}


def _plain(rows: NDArray[np.void]) -> list[list[Any]]:
    return [[value.tolist() if isinstance(value, np.ndarray) else value for value in row] for row in rows.tolist()]


def _array(rows: list[list[Any]], dtype: np.dtype[np.void] = IMPACT_DTYPE) -> NDArray[np.void]:
    array = np.array([tuple(tuple(v) if isinstance(v, list) else v for v in row) for row in rows], dtype=dtype)
    array.flags.writeable = False
    return array
