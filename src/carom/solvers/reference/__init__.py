"""The source paper's two algorithms in readable Python: the definition of PIT, and PIC frame by frame."""
