"""Study: compares two cross-checks, and reports what became better or worse."""
