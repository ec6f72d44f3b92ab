"""Main program of a worker process: reads tasks from standard input, carries them out, and writes answers.

The program is started only by `carom.execution.workers.watchdog`. An engine that prints, aborts or hangs affects only
this process. The engine's output is redirected to standard error. The parent process stores the last part of this
output, and shows it after a failure or a crash.

A message from Carom is a pickled list of tasks. An answer is a line of JSON, since its content comes from an adapter.
The line contains the number of the task, counted from the start of the process, and the `Answer`.
"""

from __future__ import annotations

import ctypes
import os
import pickle
import signal
import sys
import threading
import time
from contextlib import suppress
from functools import cache
from typing import Any, BinaryIO, get_type_hints

from carom.errors import CaromError
from carom.execution.codec import Codec
from carom.execution.exception_text import describe_exception, exception_message
from carom.execution.job import Answer, Status, T, Task, UnavailableError, UnsupportedError

#: ASCII's record separator, which separates the output of one task from the output of the next.
TASK_END = b"\x1e"

#: Exit code of a worker that can't answer, because the engine has closed the answer pipe. The value is EX_IOERR of
#: sysexits.h.
ANSWERS_CLOSED = 74

#: Seconds between checks whether the watchdog still runs. Only systems that do not end a worker with its watchdog need
#: these checks.
WATCHDOG_CHECK_S = 0.5


def carry_out(task: Task[T]) -> Answer[T]:
    """Carry out a task. An exception of the engine becomes an answer with the reason."""
    try:
        return Answer(Status.RAN, value=task.carry_out())
    except UnavailableError as error:
        return Answer(Status.UNAVAILABLE, exception_message(error))
    except UnsupportedError as error:
        return Answer(Status.UNSUPPORTED, exception_message(error))
    except CaromError as error:
        return Answer(Status.FAILED, exception_message(error))
    except MemoryError:
        return Answer(Status.FAILED, "MemoryError: the engine needs more memory than allowed; raise --memory-limit")
    except Exception as error:  # noqa: BLE001 - an engine can raise anything
        return Answer(Status.FAILED, describe_exception(error))


@cache
def build_codec(task: type[Task[T]]) -> Codec[tuple[int, Answer[T]]]:
    """Return the codec for answers to tasks of the type `task`. The return type of `carry_out` determines the codec."""
    kind: Any = get_type_hints(task.carry_out, include_extras=True)["return"]
    return Codec(tuple[int, Answer[kind]])


def _exit_after(watchdog: int) -> None:
    """Wait until the watchdog has ended, then end this process. On Linux, the system already ends this process."""
    while os.getppid() == watchdog:
        time.sleep(WATCHDOG_CHECK_S)
    os._exit(1)


def main() -> None:
    """Answer tasks until standard input ends."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the parent handles Ctrl-C and then ends this process
    requests: BinaryIO = os.fdopen(os.dup(0), "rb")
    answers: BinaryIO = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # from here on, output of an engine can't be mistaken for an answer
    os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
    if sys.platform != "linux":
        threading.Thread(target=_exit_after, args=(os.getppid(),), daemon=True).start()
    c_library = ctypes.CDLL(None)
    own_pid, number = os.getpid(), 0
    while True:
        try:
            tasks: list[Task[object]] = pickle.load(requests)  # noqa: S301 - written by our own parent process
        except EOFError:
            return
        for task in tasks:
            line = _build_answer_line(number, task)
            # the engine has forked this process; only the original process may answer
            if os.getpid() != own_pid:
                os._exit(1)
            c_library.fflush(None)  # an engine's output from C can still be buffered
            with suppress(AttributeError, OSError, ValueError):  # an engine can have closed or replaced standard output
                sys.stdout.flush()
            with suppress(OSError):
                os.write(2, TASK_END)
            # Each answer is sent at once, so that a crash loses only one task, and the parent knows which task.
            try:
                answers.write(line)
                answers.flush()
            except OSError:
                os._exit(ANSWERS_CLOSED)
            number += 1


def _build_answer_line(number: int, task: Task[object]) -> bytes:
    answer = carry_out(task)
    try:
        return build_codec(type(task)).dumps((number, answer)) + b"\n"
    except Exception as error:  # noqa: BLE001 - an object of an adapter can raise anything
        reason = f"its result can't be sent: {describe_exception(error)}"
        return build_codec(type(task)).dumps((number, Answer(Status.FAILED, reason))) + b"\n"
