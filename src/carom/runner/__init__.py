"""Running scenes on engines: plan, drive, worker processes, and the cross-check of many."""
