"""Error handler for outputs with a small alphabet, such as ASCII: it replaces each sign by a similar one."""

from __future__ import annotations

import codecs
import unicodedata

#: The error handler's name, for `open`, `str.encode` and `io.TextIOWrapper.reconfigure`.
ERRORS = "carom.plain"

#: The report's own signs; no two marks of a grade share one.
_SIGNS = {
    "✓": "=",
    "≃": "~",
    "≈": "s",
    "▲": "i",
    "↗": "/",
    "⇗": "%",
    "✗": "X",
    "○": "o",
    "∅": "-",
    "†": "C",
    "⧖": "T",
    "·": ".",
    "Δ": "d",
    "ω": "w",
    "→": "->",
    "∞": "inf",
    "≤": "<=",
    "°": " deg",
    "±": "+-",
    "\u00d7": "x",
    "\u2013": "-",
}


def _plain(error: UnicodeError) -> tuple[str, int]:
    if not isinstance(error, UnicodeEncodeError):
        raise error
    found = "".join(_SIGNS.get(sign) or _nearest(sign) for sign in error.object[error.start : error.end])
    return found, error.end


def _nearest(sign: str) -> str:
    """Return a letter without its accent, a line of a table as a dash, and anything else as a question mark."""
    bare = unicodedata.normalize("NFKD", sign).encode("ascii", "ignore").decode()
    return bare or ("-" if unicodedata.name(sign, "").startswith("BOX DRAWINGS") else "?")


codecs.register_error(ERRORS, _plain)
