"""The commands of `carom`, one module for each.

A command parses its options and arguments, calls a study, and prints the result.
"""
