"""The compiled core: times of impact, and the loops of PIC and PIT, in C11 without dependencies.

Headers and `.c` files are the core, of which `carom_core.h` is the overview. The `.pyx` files bind it to Python.
"""
