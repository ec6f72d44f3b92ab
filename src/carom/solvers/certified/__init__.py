"""Certified runs: PIC in interval arithmetic, in which every number has a proven error bound.

An interval is a *ball* of the package python-flint: a midpoint and a radius. If python-flint is not installed,
`certify` raises MissingExtraError.
"""
