import json
import unicodedata

from hypothesis import given
from hypothesis import strategies as st
from tests.cases import each

from carom.support.escaping import escape_controls, find_last_message, shorten


def test_only_control_and_direction_characters_are_escaped() -> None:
    """Exactly the control characters, direction marks and line separators are escaped; visible text is not."""
    shown = []
    for number in (*range(0x3_0000), *range(0xE_0000, 0xE_1000)):  # of the rest none is in use
        sign = chr(number)
        commands = unicodedata.category(sign) in {"Cc", "Zl", "Zp", "Cs"} and sign not in "\t\n"
        turns = unicodedata.bidirectional(sign) in {"LRE", "RLE", "LRO", "RLO", "PDF", "LRI", "RLI", "FSI", "PDI"}
        if commands or turns:
            assert escape_controls(sign) == f"\\u{number:04x}"
        elif unicodedata.category(sign) != "Cf":  # of what is not seen some is hidden, too
            shown.append(sign)
    assert escape_controls("".join(shown)) == "".join(shown)


@given(st.text())
def test_escaped_json_has_the_same_value(text: str) -> None:
    """Escaped JSON is one line that reads back as the original, and a second pass changes nothing."""
    line = escape_controls(json.dumps(text, ensure_ascii=False))
    assert json.loads(line) == text
    assert escape_controls(line) == line
    assert len(line.splitlines()) == 1


def test_long_message_is_shortened_to_60_characters() -> None:
    """A message of more than 60 characters is cut to 60 and ends in three full stops."""
    assert [shorten("a" * length) for length in (60, 61, 10**6)] == ["a" * 60, *["a" * 57 + "..."] * 2]


@each(
    "printed, said",
    [
        ("", ""),
        ("\n  \n", ""),
        ("solving\nassertion failed in solver.c:42\n\n", "assertion failed in solver.c:42"),
        ("Traceback (most recent call last):\n  File\nValueError: no mass\n", "ValueError: no mass"),
        (
            "Error [ERR_X]: none\n    at new NodeError (node:1)\n  code: 'ERR_X'\n}\n\nNode.js v20\n",
            "Error [ERR_X]: none",
        ),
        ("error: long ago\n" + "step\n" * 40, "step"),
        ("x" * 300, "x" * 200),
    ],
)
def test_last_message_is_the_line_with_the_error(printed: str, said: str) -> None:
    """The error in an output, or else its last line, is found, also before Node's version, and cut to 200."""
    assert find_last_message(printed) == said
