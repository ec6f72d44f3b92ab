"""The keeper of a worker process: it ends the worker with everything that it started, and outlives nobody.

Run as ``python -m carom.execution.watchdog MEMORY_BYTES`` by `carom.execution.process`, or forked by
`carom.execution.fork_server`. It forks before it loads an adapter: the child becomes the worker
(`carom.execution.worker`), which keeps standard input, output and error; the keeper watches. When the worker ends, or
the caller wants no more answers (SIGTERM, or the other end of standard input is closed) or is gone, the keeper kills
what is left and ends as the worker did.

On Linux the keeper adopts what the worker's processes leave behind, so that one that has left their session is found,
too, and a worker whose keeper was killed is killed. Elsewhere what has left the worker's process group is not found.
What is never covered: a program that leaves its session again and again faster than it is looked for, and one that left
it before the worker killed the keeper.
"""

from __future__ import annotations

import ctypes
import os
import resource
import select
import signal
import sys
from contextlib import suppress

#: From <linux/prctl.h>.
PR_SET_PDEATHSIG = 1
PR_SET_CHILD_SUBREAPER = 36


#: A child has ended; the parent has, or goes on with what was stopped; the parent wants the end.
_HEARD = (signal.SIGCHLD, signal.SIGCONT, signal.SIGTERM)


def main() -> None:
    """Keep a worker."""
    keep(os.getppid(), int(sys.argv[1]))


def keep(parent: int, memory_bytes: int) -> None:
    """Keep a worker; this returns in the worker alone, when nothing more is asked.

    Args:
        parent: The process that this one ends with.
        memory_bytes: Most that the worker may take.
    """
    keeper = os.getpid()
    on_linux(PR_SET_CHILD_SUBREAPER, 1)
    on_linux(PR_SET_PDEATHSIG, signal.SIGCONT)  # else one that its worker has stopped would never see it
    woken, wake = os.pipe()
    os.set_blocking(wake, False)
    signal.set_wakeup_fd(wake, warn_on_full_buffer=False)
    for number in _HEARD:
        signal.signal(number, lambda *_: None)  # without a handler nobody is woken
    worker = os.fork()
    if worker:
        _keep(worker, woken, parent)
    signal.set_wakeup_fd(-1)
    for number in _HEARD:
        signal.signal(number, signal.SIG_DFL)
    os.close(woken)
    os.close(wake)
    on_linux(PR_SET_PDEATHSIG, signal.SIGKILL)
    if os.getppid() != keeper:  # killed before that was said
        os._exit(1)
    os.setsid()
    _limit(memory_bytes)
    from carom.execution.worker import main as work

    work()


def _keep(worker: int, woken: int, parent: int) -> None:
    """Wait until the worker ends or nobody asks any more; kill what is left, and end as the worker did.

    Nobody asks any more where the other end of the input is closed, where the parent says so, and where it is gone: a
    process that it has forked can hold that end open.
    """
    null = os.open(os.devnull, os.O_WRONLY)
    os.dup2(null, 1)  # the end of the answers is the worker's
    os.dup2(null, 2)
    poll = select.poll()
    poll.register(0, 0)  # not for what there is to read, which is the worker's; it says when the other end is closed
    poll.register(woken, select.POLLIN)
    status: int | None = None
    while status is None and all(file == woken for file, _ in poll.poll()):
        heard = os.read(woken, select.PIPE_BUF)
        status = _reaped(worker)
        if signal.SIGTERM in heard or os.getppid() != parent:
            break
    while children := _children() if sys.platform == "linux" else [worker] * (status is None):
        for child in children:
            _kill(child)
        ended = _reaped(worker, wait=True)
        status = ended if status is None else status
    if status is not None and os.WIFSIGNALED(status):
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))  # the worker has left its own
        number = os.WTERMSIG(status)
        if number != signal.SIGKILL:
            signal.signal(number, signal.SIG_DFL)
        os.kill(os.getpid(), number)
    os._exit(1 if status is None else os.waitstatus_to_exitcode(status))


def _reaped(worker: int, *, wait: bool = False) -> int | None:
    """Take note of the children that have ended, and return how the worker did; None where it is not among them."""
    found = None
    with suppress(ChildProcessError):
        while True:
            child, status = os.waitpid(-1, 0 if wait else os.WNOHANG)
            if not child:
                break
            wait = False
            if child == worker:
                found = status
    return found


def _children() -> list[int]:
    """Return the children of this process, those adopted and those ended among them."""
    found = []
    for name in os.listdir("/proc"):
        if name.isdecimal():
            with suppress(OSError), open(f"/proc/{name}/stat", "rb") as file:
                # The name of the program, in parentheses, may hold anything; state and parent come after it.
                if int(file.read().rpartition(b")")[2].split()[1]) == os.getpid():
                    found.append(int(name))
    return found


def _kill(child: int) -> None:
    """Kill a child with its process group; before it has one of its own, alone."""
    with suppress(ProcessLookupError, PermissionError):
        group = os.getpgid(child)
        if group == os.getpgrp():
            os.kill(child, signal.SIGKILL)
        else:
            os.killpg(group, signal.SIGKILL)


def _limit(memory_bytes: int) -> None:
    """Let this process, and each that it starts, take no more memory.

    What is counted is data that can be written: address space alone is reserved by libraries far beyond what they use.
    """
    _, hard = resource.getrlimit(resource.RLIMIT_DATA)
    most = memory_bytes if hard == resource.RLIM_INFINITY else min(memory_bytes, hard)
    with suppress(ValueError, OSError):  # a system without such a limit
        resource.setrlimit(resource.RLIMIT_DATA, (most, most))


def on_linux(option: int, value: int) -> None:
    """Set an option of this process, see prctl(2), where there are such."""
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(option, value, 0, 0, 0)


if __name__ == "__main__":
    main()
