"""The search for the settings of an engine that give the least error for a cost."""
