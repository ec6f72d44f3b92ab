"""The report of a cross-check: HTML, Markdown, JSON lines and JUnit XML; and the verdict on a terminal."""

from carom.report.terminal import verdict_line, verdict_table
from carom.report.write import ReportPaths, require_writable, write_report

__all__ = ["ReportPaths", "require_writable", "verdict_line", "verdict_table", "write_report"]
