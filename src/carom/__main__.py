"""The `carom` command, also as ``python -m carom``: from its first moment on a signal ends it in good order."""

from __future__ import annotations

import gc
import os
import signal
import sys

#: Signals of a keyboard, a closed terminal, and a system that shuts down, as far as this system has them.
SIGNALS = [one for one in signal.Signals if one.name in {"SIGINT", "SIGTERM", "SIGHUP", "SIGQUIT"}]

#: Number of new objects after which Python searches for cycles. Imported objects stay anyway. With the default of 700,
#: the search takes a fifteenth of the processor time of a short command.
_COLLECTED_FROM = 50_000

#: A lost signal is raised again at this interval, seconds, until a command has handled it. Code that cannot handle it
#: takes only microseconds. C code that called the interrupted function can drop it silently once more.
AGAIN_S = 0.01

#: Signals that have arrived.
CAME: list[signal.Signals] = []


class Ended(KeyboardInterrupt):
    """A signal has come: with its number.

    A bare `KeyboardInterrupt` that has once left an `exec`, of which dataclasses make use, has Python end as by Ctrl-C,
    whatever the exit code (`_Py_UnhandledKeyboardInterrupt` in its pythonrun.c).
    """


def main() -> None:
    """Run the command."""
    _open_what_is_closed()
    heard = [number for number in SIGNALS if signal.getsignal(number) is not signal.SIG_IGN]  # as `nohup` has it
    for number in heard:
        signal.signal(number, _end)
    gc.set_threshold(_COLLECTED_FROM, *gc.get_threshold()[1:])
    lost, sys.unraisablehook = sys.unraisablehook, _hear_again
    # Pydantic reads the entry points of all that is installed, and raises where one distribution's are spoilt.
    os.environ.setdefault("PYDANTIC_DISABLE_PLUGINS", "__all__")
    try:
        from carom.cli import command
        from carom.execution.fork_server import allow_forking

        allow_forking()
        if CAME:  # and was lost: Python ignores what is raised where it tidies up after an import
            raise Ended(CAME[-1])
        code = command()
        if CAME and code == 128 + signal.SIGINT:  # a caller that ends with what there is takes each for Ctrl-C
            code = 128 + CAME[-1]
        _hear_no_more(heard)
    except BaseException:  # what a library makes of an `Ended` that comes while it is imported is anything
        if not CAME:
            raise
        sys.stderr.write(f"carom: ended by {CAME[-1].name}\n")
        code = 128 + CAME[-1]
        _hear_no_more(heard)
    finally:
        sys.unraisablehook = lost
    gc.freeze()  # the system takes all of it back: looking for cycles in it takes an eighth of a short command's time
    sys.exit(code)


def _open_what_is_closed() -> None:
    """Lead each standard stream that is closed to nowhere: the next file to be opened would take its place."""
    while (file := os.open(os.devnull, os.O_RDWR)) <= 2:
        pass
    os.close(file)
    sys.stdout = sys.stdout or open(1, "w", encoding="utf-8", closefd=False)  # noqa: SIM115 - to the end
    sys.stderr = sys.stderr or open(2, "w", encoding="utf-8", closefd=False)  # noqa: SIM115 - to the end


def _end(number: int, _frame: object) -> None:
    """Raise what ends the command, unless it is on its way: what is tidied up then must not be broken off.

    It can have been lost, since Python ignores what is raised where nothing can hear it, in a destructor, say.
    """
    error = sys.exc_info()[1]
    while error is not None:
        if isinstance(error, Ended):
            return
        error = error.__context__
    if number not in CAME:
        CAME.append(signal.Signals(number))
    raise Ended(number)


def _hear_again(lost: sys.UnraisableHookArgs) -> None:
    """Have a signal that Python ignored, as it says with a traceback, come again; show what else was ignored."""
    if not isinstance(lost.exc_value, Ended):
        sys.__unraisablehook__(lost)
    elif hasattr(signal, "setitimer"):
        signal.signal(signal.SIGALRM, lambda _, frame: _end(CAME[-1], frame))
        signal.setitimer(signal.ITIMER_REAL, AGAIN_S, AGAIN_S)


def _hear_no_more(heard: list[signal.Signals]) -> None:
    """Leave signals to the system: all is tidied up, and nothing is left that one could break off.

    One that has come changes nothing by coming again, the exit code least of all.
    """
    if hasattr(signal, "setitimer"):
        signal.setitimer(signal.ITIMER_REAL, 0.0)
    for number in heard:
        signal.signal(number, signal.SIG_IGN if number in CAME else signal.SIG_DFL)


if __name__ == "__main__":
    main()
