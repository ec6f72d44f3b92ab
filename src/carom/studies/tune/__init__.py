"""Search for the settings of an engine with the least error."""
