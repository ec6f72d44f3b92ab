"""Adapter of pybullet."""

adapter = None
