"""Stress: sweeps to the breaking point, and invariances."""
