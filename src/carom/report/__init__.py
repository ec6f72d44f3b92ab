"""The report: a document built from results, and its renderers; JSON lines and JUnit XML straight from the results."""

from carom.report.cross_check import write_report
from carom.report.files import require_report_extra

__all__ = ["require_report_extra", "write_report"]
