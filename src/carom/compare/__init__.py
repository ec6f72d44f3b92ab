"""Scoring: align the impacts of two traces, measure the errors, pass a verdict."""
