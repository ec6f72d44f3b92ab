"""What engines do that a user would not expect, measured over many starts: `python -m tests.hazards`.

A start is the same scene begun some part of a step earlier: nothing changes but where in a step the impacts fall. One
start makes an engine look lucky or unlucky; so each figure is a range, with the share of the starts that are off.
"""
