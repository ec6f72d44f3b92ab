"""The report: a document built from results, and its renderers; JSON lines and JUnit XML straight from the results."""

from carom.report.cross_check import write_report
from carom.report.files import require_writable

__all__ = ["require_writable", "write_report"]
