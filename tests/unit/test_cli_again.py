"""The command again, as a result shows it: what it asks for is what was asked for."""

from __future__ import annotations

import shlex
from typing import Any

import pytest
from tests.unit.runs.test_asked import STUDIES
from typer.main import get_command

from carom.cli import app_of
from carom.declared import declared
from carom.shell.again import command_line

#: A text of each kind of option, by its word in `--help`; of choices the last one.
TEXTS = {"NAME": "it's", "SECONDS": "1/240", "MEGABYTES": "900", "ANGLE": "2deg", "NUMBER": "0.5", "INTEGER": "9"}
TEXTS |= {"NAME=VALUE": "a=b c", "OLD=NEW": "pit=pic"}


def asked(name: str, words: list[str]) -> tuple[dict[str, Any], str]:
    """Return what a command's body is given of some words, and the command again."""
    group: Any = get_command(app_of([name, "explain"]))
    command = group.commands[name]
    seen: list[tuple[dict[str, Any], str]] = []
    command.callback = lambda **given: seen.append((given, command_line()))
    with command.make_context(name, words) as context:
        command.invoke(context)
    return seen[0]


@pytest.mark.parametrize("study", [study for study, command in STUDIES.items() if command])
def test_the_command_again_asks_for_the_same(study: Any) -> None:
    """With every option that a study declares, the command that is shown is read as the one that was given."""
    name, *words = STUDIES[study]
    for one in declared(study).values():
        if one.flags:
            flag = one.flags[-1].partition("/")[0]
            text = TEXTS.get(one.kind.word, one.kind.word.rpartition("|")[2])
            words += [flag, text] if one.kind.word else [flag]
    given, again = asked(name, words)
    first, named, *rest = shlex.split(again)
    assert (first, named) == ("carom", name)
    assert asked(name, rest) == (given, again)
    assert all(given[option] is not None for option, one in declared(study).items() if one.flags)


def test_what_continues_or_prints_more_is_no_part_of_it() -> None:
    """A result is made again from its beginning, and is the same however much of it is printed."""
    _, again = asked("run", ["paper/missed", "--resume", "--retry", "-v", "--no-timing", "-e", "pit"])
    assert again == "carom run paper/missed --engine pit --no-timing"


def test_from_python_there_is_none(monkeypatch: pytest.MonkeyPatch) -> None:
    """What the process was started with is no command of Carom's."""
    monkeypatch.setattr("sys.argv", ["pytest", "-x"])
    assert command_line() == "carom"
