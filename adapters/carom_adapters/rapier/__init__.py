"""Adapter of Rapier."""

from carom_adapters.rapier.adapter import adapter

__all__ = ["adapter"]
