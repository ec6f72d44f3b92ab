"""Adapter of Newton."""

from carom_adapters.newton.adapter import adapter

__all__ = ["adapter"]
