"""Stepwise accuracy: each window of a run's steps compared with PIC from the run's own state at the window's start.

A *window* is a chain of steps in which some bodies meet, overlap or push. Outside of windows a body flies freely or
rests. Only states are compared, not reported contacts. There is no horizon, because every window starts from the run's
own state. `docs/theory/scoring.md` defines the measures. The modules, in the order of the calculation:

1. `active_pairs` finds the active pairs of each step.
2. `step_chains` joins active pairs to windows.
3. `compare_window` compares each `window` with PIC and PIT, which `window_runs` runs.
4. `step_watch` repeats this block by block.
5. `measure.stepwise_score` derives numbers and a grade.
"""

from carom.comparator.stepwise.step_watch import StepWatch, compute_local_truth

__all__ = ["StepWatch", "compute_local_truth"]
