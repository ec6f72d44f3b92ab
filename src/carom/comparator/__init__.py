"""Comparison of two traces of one scene: alignment, errors, verdicts and a grade."""

from carom.comparator.compare import Scorer, compare
from carom.comparator.grades import Grade
from carom.comparator.horizon import Horizon, compute_horizon, horizon
from carom.comparator.measure.errors import Errors, ImpactError
from carom.comparator.measure.stepwise_score import LocalScore
from carom.comparator.score import Score
from carom.comparator.stepwise.step_watch import compute_local_truth
from carom.comparator.verdict import Verdict

__all__ = [
    "Errors",
    "Grade",
    "Horizon",
    "ImpactError",
    "LocalScore",
    "Score",
    "Scorer",
    "Verdict",
    "compare",
    "compute_horizon",
    "compute_local_truth",
    "horizon",
]
