"""The compiled core: times of impact, and the loops of PIC and PIT, in C11 without dependencies.

Headers and `.c` files are the core; `carom_core.h` is the overview. The `.pyx` files bind it to Python. Pure functions
build on it: `time_of_impact` and `impact_law` are for arrays; `wall_features` and `input_rows` build what the core
reads; `exact_quartic` solves what the core leaves undecided. All formulas of one impact are in the headers.
"""
