"""Play page: a web page that runs PIC and PIT in the browser, with results bit-identical to Carom in Python."""
