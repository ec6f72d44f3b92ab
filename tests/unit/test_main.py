"""A signal at any moment of the command line ends it with a sentence and its own exit code."""

import gc
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
import typer
from tests.cases import each, release_after

from carom import __main__, cli


@pytest.fixture(autouse=True)
def handlers(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Each is heard, though a shell has what it starts in the background ignore Ctrl-C; and afterwards as before."""
    # the test's process is no command
    monkeypatch.setattr("carom.execution.workers.fork_server.allow_forking", lambda: None)
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
def test_signal_outside_of_a_command_is_reported_by_name(
    number: signal.Signals, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    r"""A signal that no command handles gives exit code 128 plus its number and a message with its name.

    Afterwards the signal is ignored.
    """
    app = typer.Typer()

    @app.callback(invoke_without_command=True)
    def hears() -> None:
        signal.raise_signal(number)

    monkeypatch.setattr(cli, "build_app", lambda _names: app)
    monkeypatch.setattr("sys.argv", ["carom"])
    with pytest.raises(SystemExit) as end:
        __main__.main()
    assert end.value.code == 128 + number
    assert capsys.readouterr().err == f"carom: ended by {number.name}\n"
    assert signal.getsignal(number) is signal.SIG_IGN
    assert signal.getsignal(signal.SIGQUIT) is signal.SIG_DFL


def test_ignored_signal_stays_ignored(monkeypatch: pytest.MonkeyPatch) -> None:
    """A signal that was ignored when the command began, as under `nohup`, does not end the command."""

    def command() -> int:
        signal.raise_signal(signal.SIGHUP)
        return 7

    signal.signal(signal.SIGHUP, signal.SIG_IGN)
    assert run_main(monkeypatch, command) == 7
    assert signal.getsignal(signal.SIGHUP) is signal.SIG_IGN


@pytest.mark.skipif(sys.platform == "win32", reason="a shell closes them")
def test_command_works_with_closed_standard_streams(tmp_path: Path) -> None:
    """With closed standard streams a command prints nothing and ends with its usual exit code."""
    command = 'exec "$0" -m carom --version <&- >&- 2>&-'
    done = subprocess.run(["sh", "-c", command, sys.executable], cwd=tmp_path, capture_output=True, check=False)
    assert (done.returncode, done.stdout, done.stderr) == (0, b"", b"")


#: What a command does in a process of its own, and the signal that must end it.
ENDED = {
    "by a second Ctrl-C too, after all is tidied up": (
        "import atexit\n"
        "atexit.register(lambda: signal.raise_signal(signal.SIGINT))\n"
        "signal.signal(signal.SIGINT, signal.SIG_DFL)\n"
        "def command(): signal.raise_signal(signal.SIGINT)\n",
        signal.SIGINT,
    ),
    "within an exec, which a bare KeyboardInterrupt leaves": (
        "def command(): exec('signal.raise_signal(signal.SIGTERM)')\n",
        signal.SIGTERM,
    ),
    "in a destructor, where nothing can hear it: it comes again": (
        "class Lost:\n"
        "    def __del__(self): signal.raise_signal(signal.SIGHUP)\n"
        "def command(): Lost(); time.sleep(3600)\n",
        signal.SIGHUP,
    ),
}


@pytest.mark.skipif(not hasattr(signal, "setitimer"), reason="there is nothing to come again by")
@each("how", release_after(2, ENDED))
def test_signal_ends_a_process_with_its_code_and_a_message(how: str, tmp_path: Path) -> None:
    """A signal at exit, in an `exec` or in a destructor gives exit code 128 plus its number and one message."""
    script, number = ENDED[how]
    head = "import signal, time; from carom import __main__, cli\n"
    (tmp_path / "script.py").write_text(f"{head}{script}cli.run_command_line = command\n__main__.main()\n")
    command = [sys.executable, "-m", "script"]
    # A process that hears nothing sleeps for an hour. The limit only ends that, however slowly the process starts.
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False, timeout=600)
    assert (done.returncode, done.stderr) == (128 + number, f"carom: ended by {number.name}\n")


class Lost:
    """Ends at a signal, of which Python says that it is ignored."""

    def __del__(self) -> None:
        signal.raise_signal(signal.SIGINT)


def test_signal_lost_during_an_import_ends_the_command(monkeypatch: pytest.MonkeyPatch) -> None:
    """If Python ignored a Ctrl-C while Carom was imported, the command does not run and exits with 130."""
    __main__.CAME.append(signal.SIGINT)
    assert run_main(monkeypatch, lambda: 7) == 130


def run_main(monkeypatch: pytest.MonkeyPatch, command: Callable[[], int]) -> object:
    monkeypatch.setattr(cli, "run_command_line", command)
    with pytest.raises(SystemExit) as end:
        __main__.main()
    return end.value.code


@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
def test_second_signal_ends_the_command_after_a_lost_one(monkeypatch: pytest.MonkeyPatch) -> None:
    """If Python ignored the exception of a first Ctrl-C, a second one ends the command with exit code 130."""

    def command() -> int:
        Lost()
        signal.raise_signal(signal.SIGINT)
        return 0

    assert run_main(monkeypatch, command) == 130


def test_cleanup_after_a_signal_is_not_interrupted(monkeypatch: pytest.MonkeyPatch) -> None:
    """A second signal interrupts neither the cleanup after the first nor the handling of another exception."""
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

    assert run_main(monkeypatch, command) == 128 + signal.SIGTERM
    assert tidied == ["inside", "outside"]


def test_error_caused_by_a_signal_is_reported_as_the_signal(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """An error or exit code that follows a signal becomes the signal's; without a signal an error is raised."""

    def command() -> int:
        try:
            signal.raise_signal(signal.SIGTERM)
        except KeyboardInterrupt:
            raise ImportError("cannot load module more than once per process") from None
        return 0

    def partial_result() -> int:
        try:
            signal.raise_signal(signal.SIGTERM)
        except KeyboardInterrupt:
            return 128 + signal.SIGINT  # as a certified run does
        return 0

    assert run_main(monkeypatch, command) == 128 + signal.SIGTERM
    assert capsys.readouterr().err == "carom: ended by SIGTERM\n"
    assert run_main(monkeypatch, partial_result) == 128 + signal.SIGTERM
    __main__.CAME.clear()
    monkeypatch.setattr(cli, "run_command_line", lambda: 1 // 0)
    with pytest.raises(ZeroDivisionError):
        __main__.main()
