"""The worker process: takes tasks on standard input, carries them out, answers on what was standard output.

Run as ``python -m carom.runs.worker`` by `carom.runs.process` only. Engines print, abort and hang; here they do it
to nobody else. What they print goes where standard error goes, which the parent keeps for the reason of a crash.
"""

from __future__ import annotations

import ctypes
import os
import pickle
import signal
import sys
import threading
import time
from typing import BinaryIO, TypeVar

from carom.errors import CaromError
from carom.runs.job import Answer, Status, Task, UnsupportedError

__all__ = ["answer", "main"]

#: How long a process may outlive its parent, seconds; looking costs microseconds.
PARENT_CHECK_S = 0.5

T = TypeVar("T")


def answer(task: Task[T]) -> Answer[T]:
    """Carry out a task; whatever the engine raises is the answer, too."""
    try:
        return Answer(Status.RAN, value=task.carry_out())
    except UnsupportedError as error:
        return Answer(Status.UNSUPPORTED, str(error))
    except CaromError as error:
        return Answer(Status.FAILED, str(error))
    except Exception as error:  # noqa: BLE001 - an engine can raise anything; it becomes this job's reason
        return Answer(Status.FAILED, f"{type(error).__name__}: {error}")


def _end_with(parent: int) -> None:
    """End this process when its parent is gone: killed outright, it could not tell."""
    while os.getppid() == parent:
        time.sleep(PARENT_CHECK_S)
    os._exit(1)


def main() -> None:
    """Answer tasks until standard input ends."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the parent, which then ends this process
    requests: BinaryIO = os.fdopen(os.dup(0), "rb")
    answers: BinaryIO = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # from here on whatever an engine prints can't be mistaken for an answer
    null = os.open(os.devnull, os.O_RDONLY)
    os.dup2(null, 0)
    threading.Thread(target=_end_with, args=(os.getppid(),), daemon=True).start()
    printed_from_c = ctypes.CDLL(None) if os.name == "posix" else None
    while True:
        try:
            tasks: list[Task[object]] = pickle.load(requests)  # noqa: S301 - written by our own parent process
        except EOFError:
            return
        for task in tasks:
            found = answer(task)
            if printed_from_c is not None:
                printed_from_c.fflush(None)  # what an engine printed from C is still in its buffer
            sys.stdout.flush()
            # Each answer leaves as soon as there is one: what a crash takes with it is one task, and it has a name.
            pickle.dump(found, answers, protocol=pickle.HIGHEST_PROTOCOL)
            answers.flush()


if __name__ == "__main__":
    main()
