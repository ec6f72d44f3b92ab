"""Renderers of documents, one per medium. Renderers define the appearance, not the content.

Import a renderer from its own module. So the table of a terminal does not load the page renderer, and vice versa.
"""
