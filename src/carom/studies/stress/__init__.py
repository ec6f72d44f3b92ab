"""Study: stress tests that find where each method fails, and invariances between runs."""
