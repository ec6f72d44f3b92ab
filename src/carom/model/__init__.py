"""Scenes of discs and walls, their arrays (the input of solvers), and traces (the results of runs)."""
