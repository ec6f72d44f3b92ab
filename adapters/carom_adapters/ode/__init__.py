"""Adapter of ODE."""

from carom_adapters.ode.adapter import adapter

__all__ = ["adapter"]
