"""Certified runs: event-driven simulation in ball arithmetic, in which every digit is proven.

`certify` can be imported without python-flint. Without python-flint, a call raises an error that names it.
"""
