"""Studies, one folder each. A study runs tasks on worker processes, and makes a result and a document."""
