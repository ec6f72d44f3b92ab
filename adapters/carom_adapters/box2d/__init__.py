"""Adapter of Box2D."""

from carom_adapters.box2d.adapter import adapter

__all__ = ["adapter"]
