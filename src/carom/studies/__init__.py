"""Studies: one folder for each. A study runs tasks on worker processes, and builds a report from their results."""
