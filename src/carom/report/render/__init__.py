"""Renderers of documents, one per medium. Renderers define the appearance, not the content.

Import a renderer from its own module, so that a terminal's table does not load the page renderer, and vice versa.
"""
