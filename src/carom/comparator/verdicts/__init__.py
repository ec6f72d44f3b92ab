"""Fourth stage of a comparison: verdicts on a run. Each verdict gives numbers as its reason."""
