"""The renderers of a document, each for one medium: they decide how it looks, and nothing of what it says.

Each is imported from its module, so that a terminal's table loads no page, and a page no terminal.
"""
