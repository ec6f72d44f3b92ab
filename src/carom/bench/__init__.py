"""Benchmarks of Carom's own methods: each module runs with ``python -m`` and prints a table."""
