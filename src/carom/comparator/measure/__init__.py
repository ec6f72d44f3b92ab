"""Third stage of a comparison: errors of a run against the reference, against its own states, and of each step."""
