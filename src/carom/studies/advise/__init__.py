"""Study: the largest time step at which each engine is accurate enough for a scene."""
