"""A signal at any moment of the command line ends it with a sentence and its own exit code."""

from __future__ import annotations

import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

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


def test_a_signal_within_an_exec_leaves_the_exit_code(tmp_path: Path) -> None:
    """Run by `python -m`, a bare `KeyboardInterrupt` that leaves an `exec` has Python end as by Ctrl-C."""
    script = tmp_path / "script.py"
    script.write_text(
        "import signal; from carom import __main__, cli\n"
        "def command(): exec('signal.raise_signal(signal.SIGTERM)')\n"
        "cli.command = command\n"
        "__main__.main()\n"
    )
    done = subprocess.run(
        [sys.executable, "-m", script.stem], cwd=tmp_path, capture_output=True, text=True, check=False
    )
    assert (done.returncode, done.stderr) == (128 + signal.SIGTERM, "carom: ended by SIGTERM\n")
