"""Third stage of a comparison: errors of a run, contradictions within the run, and errors of each step."""
