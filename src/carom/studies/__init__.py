"""Studies: each asks engines at the desk, and makes a result and a document of the answers; one folder each."""
