"""Renderers of documents, one per medium. They define the appearance, not the content.

Import a renderer from its own module. Then a terminal's table does not load the page renderer, and vice versa.
"""
