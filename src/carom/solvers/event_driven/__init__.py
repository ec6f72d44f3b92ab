"""PIC for any number of discs, from event to event."""

from carom.disc_arrays import DiscArrays
from carom.solvers.event_driven.run import EventDrivenRun, RunState

__all__ = ["DiscArrays", "EventDrivenRun", "RunState"]
