"""The worker process: takes tasks on standard input, carries them out, answers on what was standard output.

Started by `carom.execution.watchdog` only. Engines print, abort and hang; here they do it to nobody else. What they
print goes where standard error goes, of which the parent keeps the end, for the reason of a failure or a crash.

A message is a pickled list of tasks, which come from Carom itself. An answer is a line of JSON, since what it is made
of comes from an adapter: the number of the task, counted from the process's start, and the `Answer`.
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
from typing import Any, BinaryIO, TypeVar, get_type_hints

from carom.errors import CaromError
from carom.execution.codec import Codec
from carom.execution.exception_text import describe_exception, exception_message
from carom.execution.job import Answer, Status, Task, UnavailableError, UnsupportedError

#: Parts what one task has printed from what the next one does: ASCII's record separator.
TASK_END = b"\x1e"

#: Exit code of a worker that can't answer, since the engine has closed what it answers by: sysexits' EX_IOERR.
ANSWERS_CLOSED = 74

#: How long a process may outlive its keeper where the system does not end it, seconds; looking costs microseconds.
KEEPER_CHECK_S = 0.5

T = TypeVar("T")


def answer(task: Task[T]) -> Answer[T]:
    """Carry out a task; whatever the engine raises is the answer, too."""
    try:
        return Answer(Status.RAN, value=task.carry_out())
    except UnavailableError as error:
        return Answer(Status.UNAVAILABLE, exception_message(error))
    except UnsupportedError as error:
        return Answer(Status.UNSUPPORTED, exception_message(error))
    except CaromError as error:
        return Answer(Status.FAILED, exception_message(error))
    except MemoryError:
        return Answer(Status.FAILED, "MemoryError: it takes more than its process may; raise --memory-limit")
    except Exception as error:  # noqa: BLE001 - an engine can raise anything; it becomes this job's reason
        return Answer(Status.FAILED, describe_exception(error))


@cache
def codec_of(task: type[Task[T]]) -> Codec[tuple[int, Answer[T]]]:
    """Return what writes and reads the answers to tasks of a kind: the type stands at its `carry_out`."""
    kind: Any = get_type_hints(task.carry_out, include_extras=True)["return"]
    return Codec(tuple[int, Answer[kind]])


def _end_with(keeper: int) -> None:
    """End this process when its keeper is gone, where the system does not see to it."""
    while os.getppid() == keeper:
        time.sleep(KEEPER_CHECK_S)
    os._exit(1)


def main() -> None:
    """Answer tasks until standard input ends."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the parent, which then ends this process
    requests: BinaryIO = os.fdopen(os.dup(0), "rb")
    answers: BinaryIO = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # from here on whatever an engine prints can't be mistaken for an answer
    null = os.open(os.devnull, os.O_RDONLY)
    os.dup2(null, 0)
    if sys.platform != "linux":
        threading.Thread(target=_end_with, args=(os.getppid(),), daemon=True).start()
    printed_from_c = ctypes.CDLL(None)
    this, number = os.getpid(), 0
    while True:
        try:
            tasks: list[Task[object]] = pickle.load(requests)  # noqa: S301 - written by our own parent process
        except EOFError:
            return
        for task in tasks:
            line = _line(number, task)
            if os.getpid() != this:  # a copy that the engine has made of this process; it has nothing to say
                os._exit(1)
            printed_from_c.fflush(None)  # what an engine printed from C is still in its buffer
            with suppress(AttributeError, OSError, ValueError):  # an engine can have closed it, or put it away
                sys.stdout.flush()
            with suppress(OSError):
                os.write(2, TASK_END)
            # Each answer leaves as soon as there is one: what a crash takes with it is one task, and it has a name.
            try:
                answers.write(line)
                answers.flush()
            except OSError:
                os._exit(ANSWERS_CLOSED)
            number += 1


def _line(number: int, task: Task[object]) -> bytes:
    found = answer(task)
    try:
        return codec_of(type(task)).dumps((number, found)) + b"\n"
    except Exception as error:  # noqa: BLE001 - a value that an adapter made can fail at anything
        reason = f"what it returned can't be told: {describe_exception(error)}"
        return codec_of(type(task)).dumps((number, Answer(Status.FAILED, reason))) + b"\n"
