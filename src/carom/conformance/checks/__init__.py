"""Checks of the suite. A failed check raises `Violation`, and a check that does not apply raises `NotApplicable`."""
