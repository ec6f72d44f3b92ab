"""Comparison of two traces of one scene: alignment, errors, verdicts and a grade."""

from carom.comparator.compare import Score, Scorer, compare
from carom.comparator.grades import Grade
from carom.comparator.horizon import Horizon, horizon, horizon_of
from carom.comparator.measure.errors import Errors, ImpactError
from carom.comparator.measure.stepwise_score import LocalScore
from carom.comparator.scales import Scales
from carom.comparator.stepwise import local_truth
from carom.comparator.verdict import Finding, Verdict

__all__ = [
    "Errors",
    "Finding",
    "Grade",
    "Horizon",
    "ImpactError",
    "LocalScore",
    "Scales",
    "Score",
    "Scorer",
    "Verdict",
    "compare",
    "horizon",
    "horizon_of",
    "local_truth",
]
