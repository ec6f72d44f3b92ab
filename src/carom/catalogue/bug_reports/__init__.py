"""The group `issues`: scenes that reproduce bug reports by users of collision engines."""
