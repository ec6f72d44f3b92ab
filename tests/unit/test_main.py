"""A signal at any moment of the command line ends it with a sentence and its own exit code."""

from __future__ import annotations

import gc
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
import typer

from carom import __main__, cli


@pytest.fixture(autouse=True)
def handlers(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Each is heard, though a shell has what it starts in the background ignore Ctrl-C; and afterwards as before."""
    monkeypatch.setattr("carom.runs.template.allow", lambda: None)  # the test's process is no command
    there_were = gc.get_threshold()
    __main__.CAME.clear()
    there = {number: signal.getsignal(number) for number in __main__.SIGNALS}
    for number in there:
        signal.signal(number, signal.SIG_DFL)
    yield
    for number, handler in there.items():
        signal.signal(number, handler)
    gc.set_threshold(*there_were)


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_a_signal_outside_of_a_command_is_told_by_its_name(
    number: signal.Signals, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """While arguments are read and after a command is done nothing in it can answer: the exit code is the signal's."""
    app = typer.Typer()

    @app.callback(invoke_without_command=True)
    def hears() -> None:
        signal.raise_signal(number)

    monkeypatch.setattr(cli, "app_of", lambda _names: app)
    monkeypatch.setattr("sys.argv", ["carom"])
    with pytest.raises(SystemExit) as end:
        __main__.main()
    assert end.value.code == 128 + number
    assert capsys.readouterr().err == f"carom: ended by {number.name}\n"
    assert signal.getsignal(number) is signal.SIG_IGN
    assert signal.getsignal(signal.SIGQUIT) is signal.SIG_DFL


def test_a_second_ctrl_c_while_python_ends_changes_nothing(tmp_path: Path) -> None:
    """Two of them end a command as one does, whenever the second comes: here after all is tidied up."""
    script = tmp_path / "script.py"
    script.write_text(
        "import atexit, signal; from carom import __main__, cli\n"
        "cli.command = lambda: signal.raise_signal(signal.SIGINT)\n"
        "atexit.register(lambda: signal.raise_signal(signal.SIGINT))\n"
        "signal.signal(signal.SIGINT, signal.SIG_DFL)\n"
        "__main__.main()\n"
    )
    done = subprocess.run([sys.executable, str(script)], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (130, "carom: ended by SIGINT\n")


def test_a_signal_that_is_not_to_be_heard_is_not(monkeypatch: pytest.MonkeyPatch) -> None:
    """What was ignored when the command began, as `nohup` has it, stays ignored."""

    def command() -> int:
        signal.raise_signal(signal.SIGHUP)
        return 7

    signal.signal(signal.SIGHUP, signal.SIG_IGN)
    assert ended(monkeypatch, command) == 7
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


@pytest.mark.skipif(sys.platform == "win32", reason="a shell closes them")
@pytest.mark.parametrize(("closed", "code"), [(">&-", 0), ("2>&-", 2), ("<&- >&- 2>&-", 0)])
def test_a_standard_stream_that_is_closed_leads_nowhere(closed: str, code: int, tmp_path: Path) -> None:
    """What is printed is lost, and the exit code is right; no file that is opened later takes the stream's place."""
    word = "nonesuch" if code else "--list"
    command = f'exec "$0" -m carom stress {word} --out out {closed}'
    done = subprocess.run(["sh", "-c", command, sys.executable], cwd=tmp_path, capture_output=True, check=False)
    assert (done.returncode, done.stdout, done.stderr) == (code, b"", b"")


class Lost:
    """Ends at a signal, of which Python says that it is ignored."""

    def __del__(self) -> None:
        signal.raise_signal(signal.SIGINT)


def test_a_signal_that_is_lost_within_an_import_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    """Where Python ignores what was raised while Carom was imported, the command does not begin."""
    monkeypatch.setattr(cli, "command", lambda: 7)
    __main__.CAME.append(signal.SIGINT)
    with pytest.raises(SystemExit) as end:
        __main__.main()
    assert end.value.code == 130


@pytest.mark.skipif(not hasattr(signal, "setitimer"), reason="there is nothing to come again by")
def test_a_signal_that_python_ignores_comes_again(tmp_path: Path) -> None:
    """One that comes where nothing can hear it, in a destructor say, ends the command, with a sentence and no more."""
    script = tmp_path / "script.py"
    script.write_text(
        "import signal, time; from carom import __main__, cli\n"
        "class Lost:\n"
        "    def __del__(self): signal.raise_signal(signal.SIGHUP)\n"
        "def command(): Lost(); time.sleep(60)\n"
        "cli.command = command\n"
        "__main__.main()\n"
    )
    done = subprocess.run([sys.executable, str(script)], capture_output=True, text=True, check=False, timeout=50)
    assert (done.returncode, done.stderr) == (128 + signal.SIGHUP, "carom: ended by SIGHUP\n")


@pytest.mark.skipif(not hasattr(signal, "setitimer"), reason="there is nothing to come again by")
def test_a_signal_that_is_dropped_again_and_again_is_heard_in_the_end(tmp_path: Path) -> None:
    """Lost in a destructor, and dropped without a word three times when it comes again, it still ends the command."""
    script = tmp_path / "script.py"
    script.write_text(
        "import signal, time; from carom import __main__, cli\n"
        "class Lost:\n"
        "    def __del__(self): signal.raise_signal(signal.SIGINT)\n"
        "def command():\n"
        "    Lost()\n"
        "    for _ in range(3):\n"
        "        try: time.sleep(60)\n"
        "        except KeyboardInterrupt: pass\n"
        "    time.sleep(60)\n"
        "    return 4\n"
        "cli.command = command\n"
        "__main__.main()\n"
    )
    done = subprocess.run([sys.executable, str(script)], capture_output=True, text=True, check=False, timeout=50)
    assert (done.returncode, done.stderr) == (130, "carom: ended by SIGINT\n")


def ended(monkeypatch: pytest.MonkeyPatch, command: Callable[[], int]) -> object:
    monkeypatch.setattr(cli, "command", command)
    with pytest.raises(SystemExit) as end:
        __main__.main()
    return end.value.code


@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
def test_a_signal_that_is_lost_leaves_the_next_one_heard(monkeypatch: pytest.MonkeyPatch) -> None:
    """Where Python ignores what the first raised, a second Ctrl-C ends the command."""

    def command() -> int:
        Lost()
        signal.raise_signal(signal.SIGINT)
        return 0

    assert ended(monkeypatch, command) == 130


def test_what_is_tidied_up_at_a_signal_is_not_broken_off_by_another(monkeypatch: pytest.MonkeyPatch) -> None:
    """A second signal changes nothing, neither while the first is on its way nor where another error came of it."""
    tidied = []

    def command() -> int:
        try:
            try:
                signal.raise_signal(signal.SIGTERM)
            finally:
                signal.raise_signal(signal.SIGINT)
                tidied.append("inside")
        except KeyboardInterrupt:
            try:
                raise ValueError
            except ValueError:
                signal.raise_signal(signal.SIGINT)
            tidied.append("outside")
            raise
        return 0

    assert ended(monkeypatch, command) == 128 + signal.SIGTERM
    assert tidied == ["inside", "outside"]


def test_what_a_library_makes_of_a_signal_is_a_signal(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """An import that a signal breaks off can end in any error; without a signal an error stays what it is."""

    def command() -> int:
        try:
            signal.raise_signal(signal.SIGTERM)
        except KeyboardInterrupt:
            raise ImportError("cannot load module more than once per process") from None
        return 0

    assert ended(monkeypatch, command) == 128 + signal.SIGTERM
    assert capsys.readouterr().err == "carom: ended by SIGTERM\n"
    __main__.CAME.clear()
    monkeypatch.setattr(cli, "command", lambda: 1 // 0)
    with pytest.raises(ZeroDivisionError):
        __main__.main()


def test_who_ends_with_what_there_is_has_the_exit_code_of_the_signal(monkeypatch: pytest.MonkeyPatch) -> None:
    """A certified run that is ended returns what it has proven, with the code of Ctrl-C: TERM has its own."""

    def command() -> int:
        try:
            signal.raise_signal(signal.SIGTERM)
        except KeyboardInterrupt:
            return 130
        return 0

    assert ended(monkeypatch, command) == 143
