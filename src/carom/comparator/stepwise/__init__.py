"""Local truth: each window of steps of a run compared with PIC from the run's own state at its start.

A *window* is a chain of steps in which some bodies meet, overlap or push; outside of windows a body flies free or
rests. The states decide alone: what a method reports of its contacts is not looked at. There is no horizon, as every
window begins anew from where the run is. `docs/theory/scoring.md` says what is asked. In the order of the work:
`activity` finds which pairs are active in which step, `chains` joins them to windows, `judge` compares each `window`
with PIC and PIT by `window_runs`, `analysis` does so block by block, and `score` makes numbers and a grade of it.
"""

from carom.comparator.stepwise.analysis import StepWatch, local_truth

__all__ = ["StepWatch", "local_truth"]
