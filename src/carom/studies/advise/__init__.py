"""Study: the largest step size at which each engine is accurate enough for a scene."""
