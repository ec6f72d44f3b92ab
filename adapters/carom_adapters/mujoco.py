"""Adapter of mujoco."""

adapter = None
