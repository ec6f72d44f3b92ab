"""Play page: an interactive page with PIC and PIT in the browser, bit-identical to Carom's."""
