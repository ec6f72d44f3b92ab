"""A page on which one throws the discs: PIC and PIT in JavaScript, with the bits of Carom's own."""
