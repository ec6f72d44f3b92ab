"""The `carom` command, also as ``python -m carom``: from its first moment on a signal ends it in good order."""

from __future__ import annotations

import signal
import sys

__all__ = ["Ended", "main"]

#: Those of a keyboard, a terminal that is closed, and a system that is shut down; some systems lack some.
SIGNALS = [getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP", "SIGQUIT") if hasattr(signal, name)]


class Ended(KeyboardInterrupt):
    """A signal has come: with its number.

    A bare `KeyboardInterrupt` that has once left an `exec`, of which dataclasses make use, has Python end as by Ctrl-C,
    whatever the exit code (`_Py_UnhandledKeyboardInterrupt` in its pythonrun.c).
    """


def main() -> None:
    """Run the command."""
    heard = [number for number in SIGNALS if signal.getsignal(number) is not signal.SIG_IGN]  # as `nohup` has it
    for number in heard:
        signal.signal(number, _end)
    try:
        from carom.cli import command

        code = command()
    except KeyboardInterrupt as error:
        ended_by = signal.Signals((error.args or (signal.SIGINT,))[0])
        sys.stderr.write(f"carom: ended by {ended_by.name}\n")
        code = 128 + ended_by
    for number in heard:
        signal.signal(number, signal.SIG_DFL)  # all is tidied up: nothing is left that a signal could break off
    sys.exit(code)


def _end(number: int, _frame: object) -> None:
    for each in SIGNALS:
        signal.signal(each, signal.SIG_IGN)  # once is enough; what is tidied up now must not be broken off
    raise Ended(number)


if __name__ == "__main__":
    main()
