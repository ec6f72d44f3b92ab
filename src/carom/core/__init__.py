"""The compiled core: times of impact, and the loops of PIC and PIT, in C11 without dependencies.

Headers and `.c` files are the core, and `carom_core.h` gives an overview of the core. The headers contain all formulas
for a single impact. The `.pyx` files make the core available in Python. The modules `time_of_impact` and `impact_law`
contain functions for arrays. `wall_features` and `input_rows` build the rows of numbers that the core reads.
`exact_quartic` decides cases that the core leaves undecided.
"""
