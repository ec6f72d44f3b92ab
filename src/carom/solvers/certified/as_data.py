"""Certified runs as data: plain numbers, lossless in JSON, that can be read where python-flint is not installed."""

from __future__ import annotations

import dataclasses
import math
from typing import TYPE_CHECKING, Any

import numpy as np

from carom.errors import InputError
from carom.scene import Scene
from carom.solvers.certified.result import CertifiedTrace, Degeneracy, Degenerate, Ending
from carom.trace import IMPACT_DTYPE, Outcome, Trace

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import NDArray

__all__ = ["enclosures", "from_enclosures"]

_FORMAT = "carom certified run, 1"


def enclosures(certified: CertifiedTrace) -> dict[str, Any]:
    """Return a certified run as what JSON can hold; a number's truth is within its radius of it."""
    trace, degeneracy = certified.trace, certified.degeneracy
    return {
        "format": _FORMAT,
        "scene": trace.scene.model_dump(mode="json"),
        "digits": certified.digits,
        "ending": certified.ending.name,
        "outcome": trace.outcome.name,
        "degeneracy": None
        if degeneracy is None
        else dataclasses.asdict(degeneracy)
        | {"kind": degeneracy.kind.name, "latest_s": None if math.isinf(degeneracy.latest_s) else degeneracy.latest_s},
        "end_time_s": trace.end_time_s,
        "fields": list(IMPACT_DTYPE.names or ()),
        "impacts": _plain(trace.impacts),
        "radii": _plain(certified.radii),
        "decimals": [list(row) for row in certified.decimals],
        "commuted": [list(pair) for pair in certified.commuted],
        "final_position_m": trace.final_position_m.tolist(),
        "final_position_radius_m": certified.final_position_radius_m.tolist(),
        "final_velocity_m_s": trace.final_velocity_m_s.tolist(),
        "final_velocity_radius_m_s": certified.final_velocity_radius_m_s.tolist(),
        "precision_bits": certified.precision_bits,
        "bits_lost": certified.bits_lost,
        "replays": certified.replays,
    }


def from_enclosures(document: Mapping[str, Any]) -> CertifiedTrace:
    """Return the certified run that `enclosures` wrote.

    Raises:
        InputError: It is no such document.
    """
    if document.get("format") != _FORMAT:
        raise InputError(f"format must be {_FORMAT!r}, got {document.get('format')!r}")
    trouble = document["degeneracy"]
    trace = Trace(
        method="certified",
        scene=Scene(**document["scene"]),
        impacts=_array(document["impacts"]),
        final_position_m=np.array(document["final_position_m"]),
        final_velocity_m_s=np.array(document["final_velocity_m_s"]),
        end_time_s=document["end_time_s"],
        outcome=Outcome[document["outcome"]],
        settings={"digits": document["digits"], "precision_bits": document["precision_bits"]},
        counts={"impacts": len(document["impacts"])},
    )
    degeneracy = None
    if trouble is not None:
        latest = math.inf if trouble["latest_s"] is None else trouble["latest_s"]
        changed = {"kind": Degenerate[trouble["kind"]], "bodies": tuple(trouble["bodies"]), "latest_s": latest}
        degeneracy = Degeneracy(**(trouble | changed))
    return CertifiedTrace(
        trace=trace,
        radii=_array(document["radii"]),
        final_position_radius_m=np.array(document["final_position_radius_m"]),
        final_velocity_radius_m_s=np.array(document["final_velocity_radius_m_s"]),
        digits=document["digits"],
        ending=Ending[document["ending"]],
        decimals=tuple(tuple(row) for row in document["decimals"]),
        degeneracy=degeneracy,
        commuted=tuple((a, b) for a, b in document["commuted"]),
        precision_bits=document["precision_bits"],
        bits_lost=document["bits_lost"],
        replays=document["replays"],
    )


def _plain(rows: NDArray[np.void]) -> list[list[Any]]:
    return [[value.tolist() if isinstance(value, np.ndarray) else value for value in row] for row in rows.tolist()]


def _array(rows: list[list[Any]]) -> NDArray[np.void]:
    array = np.array([tuple(tuple(v) if isinstance(v, list) else v for v in row) for row in rows], dtype=IMPACT_DTYPE)
    array.flags.writeable = False
    return array
