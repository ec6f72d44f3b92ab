"""An observed run of an engine: its steps, the recorded states, and the impacts found in them."""
