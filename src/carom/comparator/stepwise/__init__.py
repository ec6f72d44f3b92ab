"""Stepwise accuracy: every few steps of a run are compared with PIC, which starts from the run's own state.

A *window* is a sequence of steps in which some bodies meet, overlap or push each other. Outside of windows a body flies
freely or rests. Only the run's states are compared, not its reported contacts. PIC starts from the run's own state at
each window's start, so even chaotic runs can be compared to their end. `docs/theory/scoring.md` defines the measures.
The modules, in the order of the calculation:

1. `active_pairs` finds the active pairs of each step: bodies that meet or push each other.
2. `step_chains` joins the active pairs of successive steps into windows.
3. `window_runs` runs PIC and PIT, and `compare_window` compares each `window` with these runs.
4. `step_watch` repeats the first three calculations for each block of steps.
5. `measure.stepwise_score` computes error measures and a grade.
"""
