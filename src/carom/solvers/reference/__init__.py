"""The two algorithms of the source paper in readable Python: the definition of PIT, and PIC frame by frame."""
