"""Event-driven PIC for any number of discs: see `carom.solvers.event_driven.run`."""
