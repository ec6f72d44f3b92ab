"""Watchdog: terminates a worker and all its descendants when the worker ends or the parent exits.

Time limits are enforced by `carom.execution.workers.worker_process`, not by the watchdog.

The watchdog is run as ``python -m carom.execution.workers.watchdog MEMORY_BYTES`` by
`carom.execution.workers.worker_process`, or forked by `carom.execution.workers.fork_server`. The watchdog forks before
it loads an adapter. The child becomes the worker (`carom.execution.workers.worker_main`) and uses standard input,
output and error. The watchdog waits for one of these events:

- The worker ends.
- The parent needs no more answers: it sends SIGTERM, or closes its end of standard input.
- The parent exits.

After the event, the watchdog kills all remaining processes and exits with the worker's status.

On Linux the watchdog adopts orphaned descendants of the worker, so that the watchdog also finds processes that have
left the session. If the watchdog is killed, the system kills the worker. On other systems, processes that have left the
worker's process group are not found. On any system, a process can survive in two cases: it changes its session faster
than the watchdog searches, or it leaves the session and then the worker kills the watchdog.
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


#: The system sends SIGCHLD if a child has ended, and SIGCONT if the parent has ended. The parent sends SIGCONT to
#: continue a stopped watchdog, and SIGTERM to end the watchdog.
_SIGNALS = (signal.SIGCHLD, signal.SIGCONT, signal.SIGTERM)


def watch_worker(parent: int, memory_bytes: int) -> None:
    """Fork a worker and wait until it ends. The function returns only in the forked worker, after its last task.

    Args:
        parent: Number of the parent process. If the parent exits, watchdog and worker end.
        memory_bytes: Memory limit of the worker.
    """
    watchdog = os.getpid()
    set_process_option(PR_SET_CHILD_SUBREAPER, 1)
    set_process_option(PR_SET_PDEATHSIG, signal.SIGCONT)  # this signal wakes a watchdog that its worker has stopped
    woken, wake = os.pipe()
    os.set_blocking(wake, False)
    signal.set_wakeup_fd(wake, warn_on_full_buffer=False)
    for number in _SIGNALS:
        signal.signal(number, lambda *_: None)  # without a handler, this signal would not wake the poll
    worker = os.fork()
    if worker:
        _wait_and_clean_up(worker, woken, parent)
    signal.set_wakeup_fd(-1)
    for number in _SIGNALS:
        signal.signal(number, signal.SIG_DFL)
    os.close(woken)
    os.close(wake)
    set_process_option(PR_SET_PDEATHSIG, signal.SIGKILL)
    if os.getppid() != watchdog:  # the parent was killed before the option was set
        os._exit(1)
    os.setsid()
    _limit_memory(memory_bytes)
    from carom.execution.workers.worker_main import main as work

    work()


def _wait_and_clean_up(worker: int, woken: int, parent: int) -> None:
    """Wait until the worker ends or is no longer needed. Kill remaining processes, and exit with the worker's status.

    The worker is no longer needed if the other end of standard input is closed, the parent sends SIGTERM, or the parent
    exits. A closed standard input is not enough as a condition: the other end stays open if the parent has forked a
    process that also holds this end.
    """
    null = os.open(os.devnull, os.O_WRONLY)
    os.dup2(null, 1)  # only the worker may keep the answer pipe open
    os.dup2(null, 2)
    poll = select.poll()
    poll.register(0, 0)  # wait only until the other end is closed; the worker reads the data
    poll.register(woken, select.POLLIN)
    status: int | None = None
    while status is None and all(file == woken for file, _ in poll.poll()):
        received = os.read(woken, select.PIPE_BUF)
        status = _reap_children(worker)
        if signal.SIGTERM in received or os.getppid() != parent:
            break
    while _has_children() if sys.platform == "linux" else status is None:
        # Until the worker has ended, only the worker is killed, because a search of all processes takes long.
        children = [worker] if status is None else _find_children()
        if not children:  # the remaining children are missing in the list of processes
            break
        for child in children:
            _kill(child)
        worker_status = _reap_children(worker, wait=True)
        status = worker_status if status is None else status
    if status is not None and os.WIFSIGNALED(status):
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))  # this process must not overwrite the core file of the worker
        number = os.WTERMSIG(status)
        if number != signal.SIGKILL:
            signal.signal(number, signal.SIG_DFL)
        os.kill(os.getpid(), number)
    os._exit(1 if status is None else os.waitstatus_to_exitcode(status))


def _reap_children(worker: int, *, wait: bool = False) -> int | None:
    """Reap the children that have ended, and return the worker's status; None if the worker has not ended."""
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


def _has_children() -> bool:
    """Whether this process has children, including adopted and ended children."""
    try:
        os.waitid(os.P_ALL, 0, os.WEXITED | os.WNOHANG | os.WNOWAIT)
    except ChildProcessError:
        return False
    return True


def _find_children() -> list[int]:
    """Return the numbers of this process's children, including adopted and ended children."""
    found = []
    for name in os.listdir("/proc"):
        if name.isdecimal():
            with suppress(OSError), open(f"/proc/{name}/stat", "rb") as file:
                # The program's name, in parentheses, can contain any character. The state and the parent's number
                # follow the name.
                if int(file.read().rpartition(b")")[2].split()[1]) == os.getpid():
                    found.append(int(name))
    return found


def _kill(child: int) -> None:
    """Kill a child and its process group. If the child is still in the watchdog's group, kill only the child."""
    with suppress(ProcessLookupError, PermissionError):
        group = os.getpgid(child)
        if group == os.getpgrp():
            os.kill(child, signal.SIGKILL)
        else:
            os.killpg(group, signal.SIGKILL)


def _limit_memory(memory_bytes: int) -> None:
    """Limit the memory of this process and of each process that it starts.

    The limit applies to writable data. Address space is not limited, because libraries reserve much more address space
    than they use.
    """
    _, hard = resource.getrlimit(resource.RLIMIT_DATA)
    limit_bytes = memory_bytes if hard == resource.RLIM_INFINITY else min(memory_bytes, hard)
    with suppress(ValueError, OSError):  # some systems have no such limit
        resource.setrlimit(resource.RLIMIT_DATA, (limit_bytes, limit_bytes))


def set_process_option(option: int, value: int) -> None:
    """Set an option of this process; see prctl(2). On systems other than Linux, do nothing."""
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(option, value, 0, 0, 0)


if __name__ == "__main__":
    watch_worker(os.getppid(), int(sys.argv[1]))
