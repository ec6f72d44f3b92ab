"""The two algorithms of the paper that inspired Carom, PIT and PIC frame by frame, in readable Python."""
