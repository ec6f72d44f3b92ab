"""Studies: each runs tasks by the scheduler, and makes a result and a document; one folder each."""
