"""Scoring: align the impacts of two traces, measure the errors, pass a verdict."""

from carom.comparator.compare import compare
from carom.comparator.score import Errors, Finding, Grade, ImpactError, Scales, Score, Verdict

__all__ = ["Errors", "Finding", "Grade", "ImpactError", "Scales", "Score", "Verdict", "compare"]
