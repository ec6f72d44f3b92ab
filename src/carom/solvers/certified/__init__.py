"""Certified runs: event-driven simulation in ball arithmetic, in which every digit is proven.

`certify` can be imported without python-flint. Calling it then raises an error that names python-flint.
"""
