"""The report: a document built from results, and its renderers; JSON lines and JUnit XML straight from the results."""

from carom.report.write import ReportPaths, require_writable, write_report

__all__ = ["ReportPaths", "require_writable", "write_report"]
