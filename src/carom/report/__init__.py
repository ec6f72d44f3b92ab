"""Reports of all studies: their content, and renderers that show it as HTML, Markdown and terminal text."""
