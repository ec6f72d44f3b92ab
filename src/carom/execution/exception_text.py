"""What to say of an exception that somebody else's code raised: its type, its words, and where it came up."""

from __future__ import annotations

import traceback
from pathlib import Path

from carom.support.escaping import visible

#: Characters of a reason: a message, and not what it was about.
MOST_REASON = 2000

_OWN = Path(__file__).resolve().parents[1]


def describe_exception(error: BaseException) -> str:
    """Return what an unexpected exception is told as: ``TypeError: its words (adapter.py, line 12)``.

    The place is the deepest one in the first file outside Carom, an adapter's as a rule, and not that in a library
    which it calls; where all of it came up in Carom, the deepest of all.
    """
    places = traceback.extract_tb(error.__traceback__)
    theirs = next((place.filename for place in places if not Path(place.filename).is_relative_to(_OWN)), None)
    deepest = [place for place in places if theirs in (None, place.filename)][-1:]
    where = "".join(f" ({Path(place.filename).name}, line {place.lineno})" for place in deepest)
    return f"{visible(type(error).__name__)}: {exception_message(error)}{visible(where)}"


def exception_message(error: BaseException) -> str:
    """Return what an exception says, as text that can be written anywhere: without control characters, and not long."""
    try:
        text = str(error)
    except Exception as second:  # noqa: BLE001 - an adapter's own error class can fail at this, too
        return f"its message can't be made: {visible(type(second).__name__)}"
    return visible(text[:MOST_REASON])[:MOST_REASON]
