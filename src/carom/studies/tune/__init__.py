"""Study: search for the settings of an engine with the smallest error."""
