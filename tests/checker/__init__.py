"""Watches a PIC run from outside and says whether each of its impacts can have happened, and none has been missed.

It knows the start, the recorded impacts, and the state at some instants on the way, and keeps its own books: each disc
flies straight, or falls, with the velocities that its impacts gave it. It shares no arithmetic with the solvers. All
bounds are on rounding (`flights`), none is chosen.
"""

from tests.checker.report import RULES, Report, Violation
from tests.checker.rules import check
from tests.checker.watch import Stretch, watch

__all__ = ["RULES", "Report", "Stretch", "Violation", "check", "watch"]
