"""Modules shared by the adapters of several engines."""
