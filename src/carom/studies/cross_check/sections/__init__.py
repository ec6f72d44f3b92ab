"""Sections of the report of a cross-check. Each section is computed from the grid."""
