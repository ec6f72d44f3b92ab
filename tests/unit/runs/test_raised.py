"""What somebody else's exception is told as."""

from __future__ import annotations

from carom.runs.raised import raised


def test_the_name_of_an_exception_is_shown_as_harmlessly_as_its_words() -> None:
    """An adapter's class may have any name, and its message any character; a terminal obeys neither."""
    error = type("Odd\x1b[2JError", (Exception,), {})("with\x07 a bell")
    assert raised(error) == "Odd\\u001b[2JError: with\\u0007 a bell"
