import json
import unicodedata

from hypothesis import given
from hypothesis import strategies as st
from tests.cases import each

from carom.support.escaping import escape_controls, find_last_message, shorten


def test_every_control_and_every_turn_of_direction_is_shown() -> None:
    """Exactly the characters that command a terminal, turn the writing or end a line are escaped."""
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
def test_json_stays_the_same_json(text: str) -> None:
    """The escapes are those of JSON: what is read back is what was written, and a second pass changes nothing."""
    line = escape_controls(json.dumps(text, ensure_ascii=False))
    assert json.loads(line) == text
    assert escape_controls(line) == line
    assert len(line.splitlines()) == 1


@each("length, shown", [(60, 60), (61, 60), (10**6, 60)])
def test_a_message_shows_so_many_characters(length: int, shown: int) -> None:
    """What is longer than a message shows is cut, and says so by three full stops."""
    text = shorten("a" * length)
    assert len(text) == shown
    assert text.endswith("...") == (length > 60)


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
def test_last_words_are_the_line_that_tells_the_error(printed: str, said: str) -> None:
    """A trace of node's ends with its version after the error; if no line is an error, the last counts."""
    assert find_last_message(printed) == said
