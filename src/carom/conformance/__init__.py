"""The conformance suite. ``pytest --carom-engine NAME`` runs it on any adapter, in the adapter's own repository.

`carom.conformance.plugin` is the pytest plug-in. Only it and `carom.conformance.pytest_items` import pytest. The checks
use an adapter only through its interface, and call its engine in a worker process.
"""
