"""A page on which one throws the discs: PIC and PIT in JavaScript, with Carom's bits, and engines that run in a browser."""
