"""The worker process: takes requests on standard input, runs them on an engine, answers on what was standard output.

Run as ``python -m carom.runs.worker`` by `carom.runs.process` only. Engines print, abort and hang; here they do it
to nobody else. What they print goes where standard error goes, which the parent keeps for the reason of a crash.
"""

from __future__ import annotations

import os
import pickle
import signal
import sys
import threading
import time
from collections.abc import Callable
from typing import Any, BinaryIO

from carom.errors import CaromError
from carom.registry import load_adapter
from carom.runs.drive import observe_run, time_run
from carom.runs.messages import Failure, Request, Task

__all__ = ["answer", "main", "serve"]

#: How long a process may outlive its parent, seconds; looking costs microseconds.
PARENT_CHECK_S = 0.5


def answer(request: Request | Task) -> object:
    """Carry out one request; whatever the engine raises is the answer, too."""
    try:
        if isinstance(request, Task):
            return request.carry_out()
        adapter = load_adapter(request.engine)
        if request.timing_runs:
            return time_run(adapter, request.scene, request.profile, request.dt_s, runs=request.timing_runs)
        return observe_run(adapter, request.scene, request.profile, request.dt_s, samples=request.samples)
    except CaromError as error:
        return Failure(str(error))
    except Exception as error:  # noqa: BLE001 - an engine can raise anything; it becomes this cell's reason
        return Failure(f"{type(error).__name__}: {error}")


def _end_with(parent: int) -> None:
    """End this process when its parent is gone: killed outright, it could not tell."""
    while os.getppid() == parent:
        time.sleep(PARENT_CHECK_S)
    os._exit(1)


def serve(answer_to: Callable[[Any], object]) -> None:
    """Answer requests until standard input ends."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the parent, which then ends this process
    requests: BinaryIO = os.fdopen(os.dup(0), "rb")
    answers: BinaryIO = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # from here on whatever an engine prints can't be mistaken for an answer
    null = os.open(os.devnull, os.O_RDONLY)
    os.dup2(null, 0)
    threading.Thread(target=_end_with, args=(os.getppid(),), daemon=True).start()
    while True:
        try:
            message = pickle.load(requests)  # noqa: S301 - written by our own parent process
        except EOFError:
            return
        for request in message if isinstance(message, list) else [message]:
            # Each answer leaves as soon as there is one: what a crash takes with it is one task, and it has a name.
            pickle.dump(answer_to(request), answers, protocol=pickle.HIGHEST_PROTOCOL)
            answers.flush()
            sys.stdout.flush()


def main() -> None:
    """Serve the requests of a cross-check."""
    serve(answer)


if __name__ == "__main__":
    main()
