"""The compiled core: times of impact, and the loops of PIC and PIT, in C11 without dependencies.

Headers and `.c` files are the core; `carom_core.h` is the overview. The `.pyx` files bind it to Python. Pure functions
build on it: `time_of_impact`, `impact_law` and `rough_impact` are for arrays; `features`, `wall_features` and
`numbered` build the features of finite walls that the core reads; `exact_quartic` solves what the core leaves
undecided. All formulas of one impact are in the headers.
"""
