"""The two algorithms of the source paper in readable Python: PIT, and PIC frame by frame."""
