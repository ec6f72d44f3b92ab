"""Study: stress tests, which find the value at which each method fails, and invariances between runs."""
