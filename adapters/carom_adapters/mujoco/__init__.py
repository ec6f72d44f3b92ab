"""Adapter of MuJoCo."""

from carom_adapters.mujoco.adapter import adapter

__all__ = ["adapter"]
