"""Play page: PIC and PIT in the browser, bit-identical to Carom's."""
