"""Carom's own methods, PIC and PIT, which compute a trace (the result of a run) from a scene."""
