"""The `carom` command, also as ``python -m carom``. A signal ends it cleanly, even while Carom is being imported."""

from __future__ import annotations

import gc
import os
import signal
import sys

#: Signals of a keyboard, of a closed terminal, and of a system that shuts down, if this system has them.
SIGNALS = [one for one in signal.Signals if one.name in {"SIGINT", "SIGTERM", "SIGHUP", "SIGQUIT"}]

#: Number of new objects after which Python searches for cycles: more than a short command with a report creates.
#: Imported objects are never freed anyway. With the default of 700, the search takes a fifteenth of the processor time
#: of a short command.
_COLLECTED_FROM = 400_000

#: Interval, seconds, at which a lost signal is raised again until the command has handled it. Code that can't handle it
#: takes only microseconds, but C code that called the interrupted function can drop the signal again.
AGAIN_S = 0.01

#: Signals that have arrived.
CAME: list[signal.Signals] = []


class Ended(KeyboardInterrupt):
    """A signal has arrived. The argument is its number.

    A bare `KeyboardInterrupt` that has left an `exec` makes Python end as if by Ctrl-C, whatever the exit code. See
    `_Py_UnhandledKeyboardInterrupt` in Python's pythonrun.c. Dataclasses use `exec`.
    """


def main() -> None:
    """Run the command."""
    _open_closed_streams()
    handled = [number for number in SIGNALS if signal.getsignal(number) is not signal.SIG_IGN]  # `nohup` ignores some
    for number in handled:
        signal.signal(number, _end)
    gc.set_threshold(_COLLECTED_FROM, *gc.get_threshold()[1:])
    previous_hook, sys.unraisablehook = sys.unraisablehook, _raise_again
    # Pydantic reads the entry points of all installed packages, and fails if those of one package are damaged.
    os.environ.setdefault("PYDANTIC_DISABLE_PLUGINS", "__all__")
    # OpenBLAS starts a thread per core while NumPy is imported, in each process. A thread loops while it waits, and
    # takes tens of megabytes of address space. Carom multiplies small matrices only. Engines inherit the variable.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    try:
        from carom.cli import run_command_line
        from carom.execution.fork_server import allow_forking

        allow_forking()
        if CAME:  # the signal was lost: Python ignores exceptions in its cleanup after an import
            raise Ended(CAME[-1])
        code = run_command_line()
        if CAME and code == 128 + signal.SIGINT:  # commands that save finished results treat every signal as Ctrl-C
            code = 128 + CAME[-1]
        _return_signals(handled)
    except BaseException:  # a library can turn an `Ended` that comes during its import into any exception
        if not CAME:
            raise
        sys.stderr.write(f"carom: ended by {CAME[-1].name}\n")
        code = 128 + CAME[-1]
        _return_signals(handled)
    finally:
        sys.unraisablehook = previous_hook
    gc.freeze()  # the process ends: a search for cycles would take an eighth of a short command's time
    sys.exit(code)


def _open_closed_streams() -> None:
    """Open each closed standard stream on the null device, so that no other file takes the stream's place."""
    while (file := os.open(os.devnull, os.O_RDWR)) <= 2:
        pass
    os.close(file)
    sys.stdout = sys.stdout or open(1, "w", encoding="utf-8", closefd=False)  # noqa: SIM115 - to the end
    sys.stderr = sys.stderr or open(2, "w", encoding="utf-8", closefd=False)  # noqa: SIM115 - to the end


def _end(number: int, _frame: object) -> None:
    """Raise `Ended`, unless an earlier `Ended` is being handled, because its cleanup must not be interrupted.

    Python ignores exceptions in some places, such as destructors, so an earlier `Ended` can have been lost.
    """
    error = sys.exc_info()[1]
    while error is not None:
        if isinstance(error, Ended):
            return
        error = error.__context__
    if number not in CAME:
        CAME.append(signal.Signals(number))
    raise Ended(number)


def _raise_again(unraisable: sys.UnraisableHookArgs) -> None:
    """If Python has ignored an `Ended`, raise it again. Show any other ignored exception."""
    if not isinstance(unraisable.exc_value, Ended):
        sys.__unraisablehook__(unraisable)
    elif hasattr(signal, "setitimer"):
        signal.signal(signal.SIGALRM, lambda _, frame: _end(CAME[-1], frame))
        signal.setitimer(signal.ITIMER_REAL, AGAIN_S, AGAIN_S)


def _return_signals(handled: list[signal.Signals]) -> None:
    """Restore the system's default handling of signals, after all cleanup, when nothing is left to interrupt.

    A signal that has already arrived is ignored from now on, so it can't change the exit code.
    """
    if hasattr(signal, "setitimer"):
        signal.setitimer(signal.ITIMER_REAL, 0.0)
    for number in handled:
        signal.signal(number, signal.SIG_IGN if number in CAME else signal.SIG_DFL)


if __name__ == "__main__":
    main()
