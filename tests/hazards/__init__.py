"""What engines do that a user would not expect, measured at many phases: `python -m tests.hazards`.

A phase is a fraction of a step by which the scene begins earlier: only the times of the impacts within a step change.
An engine can be lucky or unlucky at one phase. So each figure is a range, with the number of phases with an error.
"""
