"""Carom's own methods, which compute the trace of a scene: PIC event-driven, PIC frame by frame, and PIT."""
