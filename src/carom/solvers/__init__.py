"""Carom's own methods, which compute a trace from a scene: PIC event-driven, PIC frame by frame, and PIT."""
