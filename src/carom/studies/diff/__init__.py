"""Study: comparison of two cross-checks, and what became better or worse."""
