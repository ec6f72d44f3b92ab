"""Adapter of pymunk."""

from carom_adapters.pymunk.adapter import adapter

__all__ = ["adapter"]
