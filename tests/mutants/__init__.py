"""Faults planted in the numerics, one at a time, and whether a test of their package notices: `make mutants`.

`planting.py` finds places for faults and makes a copy of the sources with all of them in it, each behind a number;
`packages.py` says whose tests must notice; `running.py` tries one number after another; `__main__.py` is the command.
"""
