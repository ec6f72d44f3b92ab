"""Scoring: align the impacts of two traces, measure the errors, pass a verdict."""

from carom.comparator.compare import compare
from carom.comparator.horizon import Horizon, horizon, horizon_of
from carom.comparator.score import Errors, Finding, Grade, ImpactError, Scales, Score, Verdict

__all__ = [
    "Errors",
    "Finding",
    "Grade",
    "Horizon",
    "ImpactError",
    "Scales",
    "Score",
    "Verdict",
    "compare",
    "horizon",
    "horizon_of",
]
