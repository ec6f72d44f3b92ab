"""Renderers of documents: one for each of HTML, Markdown and terminal. They define the appearance, not the content.

Import each renderer from its own module, so that printing to a terminal does not load the code for pages, and vice
versa.
"""
