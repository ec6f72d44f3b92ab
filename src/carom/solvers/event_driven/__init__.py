"""PIC for any number of discs, from event to event: `carom.solvers.event_driven.run`."""
