"""Conformance suite: tests of an adapter. ``pytest --carom-engine NAME`` runs the suite in the adapter's repository.

Only `carom.conformance.plugin` (the pytest plug-in) and `carom.conformance.pytest_items` import pytest. Checks use an
adapter only through its interface, and run its engine in a worker process.
"""
