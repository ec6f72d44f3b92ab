"""Results as pandas data frames: one row per impact or run, with units in the column names."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from functools import singledispatch
from operator import attrgetter
from typing import TYPE_CHECKING, Any

import numpy as np

from carom.comparator import Errors, Score
from carom.errors import MissingExtraError
from carom.execution.results import Results
from carom.model.trace import EdgeKind, Trace, format_setting

if TYPE_CHECKING:
    from pandas import DataFrame


def to_pandas(thing: object) -> DataFrame:
    """Return the impacts of a trace, or the runs of results.

    Raises:
        MissingExtraError: pandas is not installed.
    """
    try:
        import pandas as pd
    except ImportError:
        raise MissingExtraError(
            "a data frame needs pandas, which is not installed", hints=["pip install 'carom[pandas]'"]
        ) from None
    return pd.DataFrame(_build_columns(thing)).rename_axis("impact" if isinstance(thing, Trace) else "run")


def _format_error_column(metric: str) -> str:
    """Return the column name of a metric. A column without a unit is relative to the scene's own scales."""
    name, _, unit = metric.rpartition("_")
    return f"{name}_error_{unit}" if unit in {"s", "rad"} else f"{metric}_error"


@singledispatch
def _build_columns(thing: object) -> dict[str, Any]:
    raise TypeError(f"a {type(thing).__name__} can't be converted to a data frame")


@_build_columns.register
def _(thing: Trace) -> dict[str, Any]:
    columns: dict[str, Any] = {}
    for name in thing.impacts.dtype.names or ():
        values = thing.impacts[name]
        unit = "_m_s" if name.startswith("velocity_") else ""
        vector = {f"{name}_x{unit}": values[:, 0], f"{name}_y{unit}": values[:, 1]} if values.ndim > 1 else {}
        columns |= vector or {name: values}
    if thing.effective_time_s is not None:
        columns["effective_time_s"] = thing.effective_time_s
    if thing.spins is not None:
        columns |= {f"spin_{name}_rad_s": thing.spins[name] for name in thing.spins.dtype.names or ()}
    if thing.edges is not None:
        columns["edge"] = thing.edges["edge"]
        columns["edge_kind"] = [
            "" if kind < 0 else EdgeKind(kind).name.lower() for kind in thing.edges["kind"].tolist()
        ]
    return columns


@_build_columns.register
def _(thing: Results) -> dict[str, Any]:
    columns: dict[str, list[Any]] = {"scene": [row.job.scene.name for row in thing.rows]}
    columns |= {name: [getattr(row.job, name) for row in thing.rows] for name in _OF_JOB}
    columns["tried"] = [
        ", ".join(f"{name}={format_setting(value)}" for name, value in row.job.method.tried) for row in thing.rows
    ]
    columns["status"] = [row.status.value for row in thing.rows]
    columns["reason"] = [row.reason for row in thing.rows]
    columns["grade"] = [None if row.grade is None else row.grade.name.lower() for row in thing.rows]
    for name, of_score in _OF_SCORE.items():
        columns[name] = [np.nan if row.score is None else of_score(row.score) for row in thing.rows]
    columns["advance_s"] = [np.nan if row.timing is None else row.timing.advance_s for row in thing.rows]
    columns["time_over_pit"] = [np.nan if row.time_ratio is None else row.time_ratio for row in thing.rows]
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
