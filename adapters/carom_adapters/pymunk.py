"""Adapter of pymunk."""

adapter = None
