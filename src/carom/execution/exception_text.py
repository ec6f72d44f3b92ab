"""Text for exceptions of third-party code: type, message and location."""

from __future__ import annotations

import traceback
from pathlib import Path

from carom.support.escaping import escape_controls

#: Longest message of an exception that is shown, in characters.
MOST_REASON = 2000

_OWN = Path(__file__).resolve().parents[1]


def describe_exception(error: BaseException) -> str:
    """Return an unexpected exception as text, such as ``TypeError: message (adapter.py, line 12)``.

    The location is the traceback's last line in the first file that does not belong to Carom, which is usually the
    adapter. If all files belong to Carom, the last line of the traceback is used.
    """
    places = traceback.extract_tb(error.__traceback__)
    foreign_file = next((place.filename for place in places if not Path(place.filename).is_relative_to(_OWN)), None)
    deepest = [place for place in places if foreign_file in (None, place.filename)][-1:]
    location = "".join(f" ({Path(place.filename).name}, line {place.lineno})" for place in deepest)
    return f"{escape_controls(type(error).__name__)}: {exception_message(error)}{escape_controls(location)}"


def exception_message(error: BaseException) -> str:
    """Return the message of an exception, without control characters and of limited length."""
    try:
        text = str(error)
    except Exception as second:  # noqa: BLE001 - `str` of an adapter's exception can raise another exception
        return f"its message can't be built: {escape_controls(type(second).__name__)}"
    return escape_controls(text[:MOST_REASON])[:MOST_REASON]
