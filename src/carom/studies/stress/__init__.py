"""Stress: sweeps to the breaking point, and relations that need no truth."""
