"""Running scenes on engines: plan, drive, worker processes, and the cross-check of many."""

from carom.runs.cross_check import cross_check, run
from carom.runs.plan import default_dts
from carom.runs.results import Cell, Results, Row, Status, violates

__all__ = ["Cell", "Results", "Row", "Status", "cross_check", "default_dts", "run", "violates"]
