"""Adapter of PyBullet."""

from carom_adapters.pybullet.adapter import adapter

__all__ = ["adapter"]
