"""Fourth stage of a comparison: verdicts on a run, each with its numbers as a reason."""
