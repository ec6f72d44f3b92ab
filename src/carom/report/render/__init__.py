"""Renderers of documents, one per medium. They define the appearance and not the content.

Each is imported from its module, so that a terminal's table loads no page, and a page no terminal.
"""
