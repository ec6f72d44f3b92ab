"""Carom's own methods, PIC and PIT. They compute a trace (the result of a run) from a scene."""
