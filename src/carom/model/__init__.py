"""Data types: scenes with discs and walls, the same as arrays for solvers, and traces with the results of runs."""
