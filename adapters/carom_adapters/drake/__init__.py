"""Adapter of Drake."""

from carom_adapters.drake.adapter import adapter

__all__ = ["adapter"]
