"""Scenes, walls, arrays of discs, and traces of runs."""
