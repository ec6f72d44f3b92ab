"""Play page: a web page that runs PIC and PIT in the browser, with the same bits as Carom in Python."""
