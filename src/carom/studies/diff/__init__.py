"""Comparison of two cross-checks: what got better and worse."""
