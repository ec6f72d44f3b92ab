"""What the documents of all studies share: blocks, words, marks, figures, records, and how they are shown."""
