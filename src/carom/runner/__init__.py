"""Running scenes on engines: plan, drive, worker processes, and the cross-check of many."""

from carom.runner.cross_check import cross_check, run
from carom.runner.plan import default_dts
from carom.runner.results import Cell, Results, Row, Status, violates

__all__ = ["Cell", "Results", "Row", "Status", "cross_check", "default_dts", "run", "violates"]
