"""The report of a cross-check: HTML, Markdown, JSON lines and JUnit XML, with figures."""
