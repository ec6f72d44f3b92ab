"""The report: a document built from results, and its renderers; JSON lines and JUnit XML straight from the results.

Names are imported from the modules, so that a list of scenes loads no cross-check.
"""
