"""Renderers of documents for HTML, Markdown and a terminal. A renderer defines the appearance, not the content.

Import each renderer from its own module, so that printing to a terminal does not load the code for pages, and vice
versa.
"""
