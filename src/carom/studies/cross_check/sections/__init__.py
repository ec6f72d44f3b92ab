"""Sections of the report of a cross-check. Each is a function of the grid."""
