"""Reports of all studies: their parts, texts, figures and files, and renderers for HTML, Markdown and a terminal."""
