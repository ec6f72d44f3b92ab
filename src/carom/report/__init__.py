"""Documents of all studies: their parts, words, marks, figures and records, and renderers for each medium."""
