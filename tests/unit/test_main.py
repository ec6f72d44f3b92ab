"""A signal at any moment of the command line ends it with a sentence and its own exit code."""

from __future__ import annotations

import signal
from collections.abc import Iterator

import pytest
import typer

from carom import __main__, cli


@pytest.fixture(autouse=True)
def handlers() -> Iterator[None]:
    """Whoever runs the tests hears signals afterwards as before."""
    there = {number: signal.getsignal(number) for number in __main__.SIGNALS}
    yield
    for number, handler in there.items():
        signal.signal(number, handler)


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_a_signal_outside_of_a_command_is_told_by_its_name(
    number: signal.Signals, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """While arguments are read and after a command is done nothing in it can answer: the exit code is the signal's."""
    app = typer.Typer()

    @app.callback(invoke_without_command=True)
    def hears() -> None:
        signal.raise_signal(number)

    monkeypatch.setattr(cli, "app", app)
    monkeypatch.setattr("sys.argv", ["carom"])
    signal.signal(number, signal.SIG_DFL)
    with pytest.raises(SystemExit) as end:
        __main__.main()
    assert end.value.code == 128 + number
    assert capsys.readouterr().err == f"carom: ended by {number.name}\n"
    assert signal.getsignal(number) is signal.SIG_DFL


def test_a_signal_that_is_not_to_be_heard_is_not(monkeypatch: pytest.MonkeyPatch) -> None:
    """What was ignored when the command began, as `nohup` has it, stays ignored."""

    def command() -> int:
        signal.raise_signal(signal.SIGHUP)
        return 7

    signal.signal(signal.SIGHUP, signal.SIG_IGN)
    monkeypatch.setattr(cli, "command", command)
    with pytest.raises(SystemExit) as end:
        __main__.main()
    assert end.value.code == 7
    assert signal.getsignal(signal.SIGHUP) is signal.SIG_IGN
