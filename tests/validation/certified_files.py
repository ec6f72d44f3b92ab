"""Certified runs read from what `carom.solvers.certified.serialisation` writes; python-flint need not be installed."""

import math
from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from carom import CertifiedTrace, Outcome, Scene, Trace
from carom.solvers.certified.result import Degeneracy, Degenerate, Ending
from carom.solvers.certified.serialisation import FINAL, FINAL_RADII, NUMBERS, RADII, ROWS


def from_enclosures(document: Mapping[str, Any]) -> CertifiedTrace:
    """Return the certified run that `enclosures` wrote."""
    trace = Trace(
        method="certified",
        scene=Scene(**document["scene"]),
        end_time_s=document["end_time_s"],
        outcome=Outcome[document["outcome"]],
        settings={"digits": document["digits"], "precision_bits": document["precision_bits"]},
        counts={"impacts": len(document["impacts"])},
        **_read(document, ROWS, FINAL),
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
        **{name: document[name] for name in NUMBERS},
        **_read(document, RADII, FINAL_RADII),
    )


def _read(document: Mapping[str, Any], rows: Mapping[str, np.dtype[np.void]], final: Iterable[str]) -> dict[str, Any]:
    found: dict[str, Any] = {name: _array(document[name], dtype) for name, dtype in rows.items() if name in document}
    return found | {name: np.array(document[name]) for name in final if name in document}


def _array(rows: list[list[Any]], dtype: np.dtype[np.void]) -> NDArray[np.void]:
    array = np.array([tuple(tuple(v) if isinstance(v, list) else v for v in row) for row in rows], dtype=dtype)
    array.flags.writeable = False
    return array
