"""Carom's own methods, which compute a trace from a scene: PIC from impact to impact, PIC frame by frame, and PIT."""
