"""Error against run time, run time against the number of discs, and the step that is good enough."""
