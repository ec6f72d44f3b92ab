"""The checks of the suite. A check returns None, or raises a `Violation` or the reason why it does not apply."""
