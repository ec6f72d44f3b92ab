"""Third stage of a comparison: errors against the reference, against the run's own states, and step by step."""
