"""Results as pandas data frames, with one row for each impact or run, and with units in the column names."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from operator import attrgetter
from typing import TYPE_CHECKING, Any

import numpy as np

from carom.comparator import Errors, Score
from carom.errors import MissingExtraError
from carom.execution.results import Results
from carom.model.trace import EdgeKind, Trace, format_setting

if TYPE_CHECKING:
    from pandas import DataFrame


def to_pandas(result: object) -> DataFrame:
    """Return the impacts of a trace, or the runs of a cross-check, as a data frame.

    Raises:
        MissingExtraError: pandas is not installed.
    """
    try:
        import pandas as pd
    except ImportError:
        raise MissingExtraError(
            "a data frame needs pandas, which is not installed", hints=["pip install 'carom[pandas]'"]
        ) from None
    if isinstance(result, Trace):
        return pd.DataFrame(_build_impact_columns(result)).rename_axis("impact")
    if isinstance(result, Results):
        return pd.DataFrame(_build_run_columns(result)).rename_axis("run")
    raise TypeError(f"a {type(result).__name__} can't be converted to a data frame")


def _format_error_column(metric: str) -> str:
    """Return the column name of an error. An error without a unit is relative, for example to the greatest speed."""
    name, _, unit = metric.rpartition("_")
    return f"{name}_error_{unit}" if unit in {"s", "rad"} else f"{metric}_error"


def _build_impact_columns(result: Trace) -> dict[str, Any]:
    columns: dict[str, Any] = {}
    for name in result.impacts.dtype.names or ():
        values = result.impacts[name]
        unit = "_m_s" if name.startswith("velocity_") else ""
        vector = {f"{name}_x{unit}": values[:, 0], f"{name}_y{unit}": values[:, 1]} if values.ndim > 1 else {}
        columns |= vector or {name: values}
    if result.effective_time_s is not None:
        columns["effective_time_s"] = result.effective_time_s
    if result.spins is not None:
        columns |= {f"spin_{name}_rad_s": result.spins[name] for name in result.spins.dtype.names or ()}
    if result.edges is not None:
        columns["edge"] = result.edges["edge"]
        columns["edge_kind"] = [
            "" if kind < 0 else EdgeKind(kind).name.lower() for kind in result.edges["kind"].tolist()
        ]
    return columns


def _build_run_columns(result: Results) -> dict[str, Any]:
    columns: dict[str, list[Any]] = {"scene": [row.job.scene.name for row in result.rows]}
    columns |= {name: [getattr(row.job, name) for row in result.rows] for name in _OF_JOB}
    columns["tried"] = [
        ", ".join(f"{name}={format_setting(value)}" for name, value in row.job.method.overrides) for row in result.rows
    ]
    columns["status"] = [row.status.value for row in result.rows]
    columns["reason"] = [row.reason for row in result.rows]
    columns["grade"] = [None if row.grade is None else row.grade.name.lower() for row in result.rows]
    for name, of_score in _OF_SCORE.items():
        columns[name] = [np.nan if row.score is None else of_score(row.score) for row in result.rows]
    columns["advance_s"] = [np.nan if row.timing is None else row.timing.advance_s for row in result.rows]
    columns["time_over_pit"] = [np.nan if row.time_ratio is None else row.time_ratio for row in result.rows]
    return columns


_OF_JOB = ("engine", "profile", "dt_s", "refinement", "phase")
_OF_SCORE: dict[str, Callable[[Score], float]] = {
    "expected": attrgetter("expected"),
    "matched": lambda score: len(score.errors),
    "missed": lambda score: len(score.missed),
    "invented": lambda score: len(score.spurious),
    "price_paid": attrgetter("price_paid"),
    **{_format_error_column(metric.name): attrgetter(f"total.{metric.name}") for metric in dataclasses.fields(Errors)},
}
