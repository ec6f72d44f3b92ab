"""The largest step that is good enough for a scene."""
