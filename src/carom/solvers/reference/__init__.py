"""The two algorithms of the paper by which Carom is inspired, in readable Python: PIT, and PIC frame by frame."""
