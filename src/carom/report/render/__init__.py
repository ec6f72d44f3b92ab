"""The renderers of a document, each for one medium: they decide how it looks, and nothing of what it says."""

from carom.report.render.html import html
from carom.report.render.markdown import markdown
from carom.report.render.terminal import terminal

__all__ = ["html", "markdown", "terminal"]
