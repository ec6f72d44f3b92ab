"""The `carom` command and ``python -m carom``. A signal such as Ctrl-C ends the command after its cleanup."""

from __future__ import annotations

import gc
import os
import signal
import sys

#: Signals that the keyboard, a closed terminal or a shutdown of the system sends. Signals that this system lacks are
#: left out.
SIGNALS = [one for one in signal.Signals if one.name in {"SIGINT", "SIGTERM", "SIGHUP", "SIGQUIT"}]

#: Number of new objects after which Python searches for reference cycles. A short command creates fewer objects, so
#: Python never searches for cycles. With Python's default of 700, the searches would take a fifteenth of a short
#: command's time.
_COLLECTED_FROM = 400_000

#: Seconds after which the exception of a signal is raised again if Python or C code has dropped the exception. The
#: exception is raised repeatedly until the command has handled it.
AGAIN_S = 0.01

#: Signals that have arrived.
CAME: list[signal.Signals] = []


class Ended(KeyboardInterrupt):
    """A signal has arrived. The argument is the signal's number.

    Carom raises this class instead of a plain `KeyboardInterrupt`. If a plain `KeyboardInterrupt` propagates out of
    `exec`, which dataclasses use, Python ignores the command's exit code. See `_Py_UnhandledKeyboardInterrupt` in
    Python's pythonrun.c.
    """


def main() -> None:
    """Run the command."""
    _open_closed_streams()
    # signals that `nohup` ignores stay ignored
    handled = [number for number in SIGNALS if signal.getsignal(number) is not signal.SIG_IGN]
    for number in handled:
        signal.signal(number, _end)
    gc.set_threshold(_COLLECTED_FROM, *gc.get_threshold()[1:])
    previous_hook, sys.unraisablehook = sys.unraisablehook, _raise_again
    # By default Pydantic reads the entry points of all installed packages, and fails if a package is damaged.
    os.environ.setdefault("PYDANTIC_DISABLE_PLUGINS", "__all__")
    # By default OpenBLAS starts a thread per core in each process that imports NumPy. Each thread loops while it waits,
    # and takes tens of megabytes of address space. Carom multiplies only small matrices and needs one thread. Engines
    # inherit this environment variable.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    try:
        from carom.cli import run_command_line
        from carom.execution.workers.fork_server import allow_forking

        allow_forking()
        if CAME:  # the signal was lost, because Python ignores exceptions during its cleanup after an import
            raise Ended(CAME[-1])
        code = run_command_line()
        # after any signal, a command that saves results returns the code of SIGINT
        if CAME and code == 128 + signal.SIGINT:
            code = 128 + CAME[-1]
        _return_signals(handled)
    # a library whose import is interrupted by `Ended` can raise any other exception instead
    except BaseException:
        if not CAME:
            raise
        sys.stderr.write(f"carom: ended by {CAME[-1].name}\n")
        code = 128 + CAME[-1]
        _return_signals(handled)
    finally:
        sys.unraisablehook = previous_hook
    gc.freeze()  # prevents a search for cycles at the exit, which takes an eighth of a short command's time
    sys.exit(code)


def _open_closed_streams() -> None:
    """Open each closed standard stream on the null device, so that no other file gets the stream's number."""
    while (file := os.open(os.devnull, os.O_RDWR)) <= 2:
        pass
    os.close(file)
    sys.stdout = sys.stdout or open(1, "w", encoding="utf-8", closefd=False)  # noqa: SIM115 - to the end
    sys.stderr = sys.stderr or open(2, "w", encoding="utf-8", closefd=False)  # noqa: SIM115 - to the end


def _end(number: int, _frame: object) -> None:
    """Raise `Ended`, unless an earlier `Ended` is being handled, because its cleanup must not be interrupted.

    If Python has dropped an earlier `Ended`, for example in a destructor, `Ended` is raised again.
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
    """Restore the system's default handling of signals. Call this function after all cleanup.

    A signal that has already arrived is ignored if it arrives again, so that it can't change the exit code.
    """
    if hasattr(signal, "setitimer"):
        signal.setitimer(signal.ITIMER_REAL, 0.0)
    for number in handled:
        signal.signal(number, signal.SIG_IGN if number in CAME else signal.SIG_DFL)


if __name__ == "__main__":
    main()
