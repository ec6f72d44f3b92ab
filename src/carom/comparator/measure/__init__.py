"""Third stage of a comparison: errors against the reference, against the run's own states, and of each step."""
