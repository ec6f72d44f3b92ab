"""Reads untrusted TOML and JSON files with limited run time and memory.

The limits are in `carom.support.limits`. Carom checks the limits before it parses a file, because a parser builds every
value in memory. The run time of some parsers also grows with the square of the file's size.
"""

from __future__ import annotations

import json
import re
import tomllib
from pathlib import Path
from typing import Any

from carom.errors import InputError
from carom.support.escaping import format_value, shorten
from carom.support.limits import MOST_BYTES, MOST_KEY_PARTS, MOST_VALUES, count_values

_PART = r"""(?>[A-Za-z0-9_-]++|"[^"\n]*+"|'[^'\n]*+')"""
_LONG_KEY = re.compile(rf"(?<![A-Za-z0-9_-])(?:{_PART}[ \t]*+\.[ \t]*+){{{MOST_KEY_PARTS}}}".encode())


def read_data(path: Path, kind: str) -> dict[str, Any]:
    """Return the content of a file: a TOML table or a JSON object.

    Args:
        path: The file, pipe or device.
        kind: Format of the content, ``.toml`` or ``.json``.

    Raises:
        InputError: The file can't be read, exceeds a limit, or does not contain a table or object. The message does not
            contain the file's name.
    """
    limit, name = MOST_BYTES[kind], kind[1:].upper()
    try:
        with path.open("rb") as file:
            data = file.read(limit + 1)  # stops just after the limit, since pipes report no size
    except OSError as error:
        raise InputError(f"can't be read: {error.strerror or error}") from None
    if len(data) > limit:
        raise InputError(f"is larger than {limit >> 20} MiB, the limit for {name}")
    lines = data.count(b"\n") + data.count(b"\r") if kind == ".toml" else 0
    if lines + count_values(data) > MOST_VALUES[kind]:
        larger = "; JSON files can have more" if kind == ".toml" else ""
        raise InputError(f"has more than {MOST_VALUES[kind]} values, the limit for {name}{larger}")
    if kind == ".toml" and _LONG_KEY.search(data):
        raise InputError(f"has a key of more than {MOST_KEY_PARTS} dotted parts")
    try:
        text = data.decode("utf-8")
        found = tomllib.loads(text) if kind == ".toml" else json.loads(text, object_pairs_hook=reject_duplicate_keys)
    except UnicodeDecodeError as error:
        raise InputError(f"is not {name}: byte {error.start} is not UTF-8 text") from None
    except RecursionError:
        raise InputError(f"its {name} is nested too deeply") from None
    except InputError:
        raise
    except ValueError as error:
        problem = (str(error) or type(error).__name__).splitlines()[0]
        raise InputError(f"is not {name}: {shorten(problem, 200)}") from None
    if not isinstance(found, dict):
        raise InputError(f"must be an object with named fields, got {format_value(found)}")
    return found


def reject_duplicate_keys(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    """Return a JSON object's pairs as a dict. Pass this function to `json.loads` as ``object_pairs_hook``.

    Raises:
        InputError: A key occurs twice. JSON parsers differ in which of the two values they use.
    """
    fields = dict(pairs)
    if len(fields) < len(pairs):
        names = [name for name, _ in pairs]
        twice = next(name for name in fields if names.count(name) > 1)
        raise InputError(f"is ambiguous: one object has the key {format_value(twice)} twice")
    return fields
