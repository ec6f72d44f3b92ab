"""Encoding error handler that replaces characters by similar ones if the output's encoding lacks them."""

from __future__ import annotations

import codecs
import unicodedata

#: The error handler's name, for `open`, `str.encode` and `io.TextIOWrapper.reconfigure`.
ERRORS = "carom.plain"

#: Replacements for the symbols of reports. No two grades have the same replacement.
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
    "µ": "u",
    "π": "pi",
    "ω": "w",
    "√": "sqrt ",
    "→": "->",
    "∞": "inf",
    "≤": "<=",
    "°": " deg",
    "±": "+-",
    "\u00d7": "x",
    "\u2013": "-",
}


def _replace_characters(error: UnicodeError) -> tuple[str, int]:
    if not isinstance(error, UnicodeEncodeError):
        raise error
    return "".join(_SIGNS.get(sign) or _find_nearest(sign) for sign in error.object[error.start : error.end]), error.end


def _find_nearest(sign: str) -> str:
    """Return a letter without its accent, a dash for a box-drawing character, and a question mark for anything else."""
    bare = unicodedata.normalize("NFKD", sign).encode("ascii", "ignore").decode()
    return bare or ("-" if unicodedata.name(sign, "").startswith("BOX DRAWINGS") else "?")


codecs.register_error(ERRORS, _replace_characters)
