"""Adapter of DART."""

from carom_adapters.dart.adapter import adapter

__all__ = ["adapter"]
