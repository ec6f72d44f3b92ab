"""Conformance suite for adapters. ``pytest --carom-engine NAME`` runs the suite in the repository of an adapter.

Only `carom.conformance.plugin` (the pytest plug-in) and `carom.conformance.pytest_items` import pytest. Checks use an
adapter only through its interface, and run its engine in a worker process.
"""
