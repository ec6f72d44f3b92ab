"""Certified runs: event-driven simulation in ball arithmetic, in which every digit is proven.

`certify` can be imported without python-flint, but calling it then raises MissingExtraError.
"""
