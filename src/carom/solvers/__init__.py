"""Carom's own methods, scene to trace: PIC event-driven, PIC frame by frame, and PIT."""
