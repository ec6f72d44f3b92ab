"""The conformance suite: ``pytest --carom-engine NAME`` runs it on any adapter, in its author's own repository.

`carom.conformance.plugin` is the pytest plug-in; it and `carom.conformance.pytest_items` alone import pytest. The
checks know an adapter by its seam only and call its engine in a worker process.
"""
