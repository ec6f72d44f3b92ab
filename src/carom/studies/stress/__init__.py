"""Study of stress tests: find the value at which each method fails, and check invariances between runs."""
