"""Stepwise accuracy: each window of steps of a run compared with PIC from the run's own state at its start.

A *window* is a chain of steps in which some bodies meet, overlap or push. Outside of windows a body flies free or
rests. Only states count; reported contacts are not used. There is no horizon, because every window starts from the
run's own state. `docs/theory/scoring.md` defines the measures. The modules, in the order of the work:

1. `activity` finds the active pairs of each step.
2. `chains` joins them to windows.
3. `judge` compares each `window` with PIC and PIT, which `window_runs` runs.
4. `analysis` does this block by block.
5. `score` derives numbers and a grade.
"""

from carom.comparator.stepwise.analysis import StepWatch, local_truth

__all__ = ["StepWatch", "local_truth"]
