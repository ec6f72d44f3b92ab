"""Fork server: a process that has imported everything and forks workers, since imports take longer than most runs.

The server is forked from the main thread of the `carom` command, before any other thread starts. The server's only open
files are the null device and a socket. The server loads no adapter and no engine. For each request, the server forks a
watchdog (`carom.execution.workers.watchdog`). The watchdog gets its own streams, folder, session, limits and
environment, like a new process. When the command ends, the server and all processes that it forked end too.

Only the command `carom` starts a fork server, and only on Linux. Another process, such as a notebook, can have threads,
which a fork does not copy. Without a server that answers, each worker starts in a new interpreter.
"""

from __future__ import annotations

import array
import gc
import os
import pickle
import select
import signal
import socket
import sys
import threading
import time
import warnings
from collections.abc import Sequence
from contextlib import suppress
from io import FileIO
from subprocess import TimeoutExpired
from typing import NoReturn

#: Seconds to wait for the server's answer. A fork takes only milliseconds.
PATIENCE_S = 2.0
#: Size limit of a request. The folder's path, the search path and the environment variables together are smaller.
MOST_REQUEST_BYTES = 2**22
#: Number of pipes of a watchdog: standard input, output and error, and one for its exit status.
_STREAMS = 4

_allowed = False


def allow_forking() -> None:
    """Allow pools of this process to fork their workers.

    Only the command `carom` calls this function, because only the command is certain to have no other threads.
    """
    global _allowed  # noqa: PLW0603 - applies to the whole process
    _allowed = True


def list_search_path() -> list[str]:
    """Return the search path of modules for a worker.

    With this path, the worker finds exactly the adapters of this process.
    """
    return [os.path.abspath(entry or os.curdir) for entry in sys.path]


class ForkedProcess:
    """A watchdog forked by the server. The class implements the methods of `subprocess.Popen` that Carom uses."""

    def __init__(self, pidfd: int, status: int, streams: tuple[FileIO, FileIO, FileIO]) -> None:
        self.stdin, self.stdout, self.stderr = streams
        self._pidfd, self._status = pidfd, status
        self._code: int | None = None

    def __del__(self) -> None:
        for file in (self._pidfd, self._status):
            os.close(file)

    def wait(self, timeout: float) -> int:
        """Return the exit code, like `subprocess.Popen.wait`.

        Raises:
            subprocess.TimeoutExpired: The process still runs after `timeout` seconds.
        """
        if self._code is None:
            if not select.select([self._status], [], [], timeout)[0]:
                raise TimeoutExpired("carom.execution.workers.watchdog", timeout)
            status = os.read(self._status, array.array("i", [0]).itemsize)
            # If the server was killed, its watchdogs were killed too, and the pipe is empty.
            self._code = array.array("i", status)[0] if status else -signal.SIGKILL
        return self._code

    def send_signal(self, number: int) -> None:
        """Send a signal if the process still runs."""
        if sys.platform == "linux":
            with suppress(ProcessLookupError):
                signal.pidfd_send_signal(self._pidfd, number)


class ForkServer:
    """Connection of the command to its fork server."""

    def __init__(self, own_socket: socket.socket, process: int) -> None:
        self._socket, self._process = own_socket, process
        self._lock = threading.Lock()
        self._lost = False

    @classmethod
    def launch(cls) -> ForkServer | None:
        """Fork a server. Return None if forking is not allowed. Without a server, workers start in new interpreters."""
        known = sys.platform == "linux" and hasattr(os, "pidfd_open")
        if not (known and _allowed and threading.active_count() == 1):
            return None
        own_socket, child_socket = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        for stream in (sys.stdout, sys.stderr):
            stream.flush()  # otherwise both processes would write the content of the buffer
        parent = os.getpid()
        with warnings.catch_warnings():
            # Python warns because the BLAS library has started threads, but BLAS supports forks.
            warnings.simplefilter("ignore", DeprecationWarning)
            child = os.fork()
        if not child:
            _serve(child_socket, parent)
        child_socket.close()
        own_socket.settimeout(PATIENCE_S)
        return cls(own_socket, child)

    def start(self, folder: str, path: str, memory_bytes: int) -> ForkedProcess | None:
        """Fork a watchdog. Return None if the server has ended or does not answer.

        Args:
            folder: Working folder.
            path: Search path of modules, as in the variable PYTHONPATH.
            memory_bytes: Memory limit of the worker.
        """
        with self._lock:
            if self._lost:
                return None
            pipes = [os.pipe() for _ in range(_STREAMS)]
            (stdin, requests), (answers, stdout), (printed, stderr), (status, status_file) = pipes
            child_files = (stdin, stdout, stderr, status_file)
            pidfds: list[int] = []
            try:
                message = pickle.dumps((folder, {**os.environ, "PYTHONPATH": path}, memory_bytes))
                socket.send_fds(self._socket, [message], child_files)
                _, pidfds, _, _ = socket.recv_fds(self._socket, 1, 1)
            except OSError:
                pass
            finally:
                for file in child_files:
                    os.close(file)
            if not pidfds:
                self._lost = True
                for file in (requests, answers, printed, status):
                    os.close(file)
                return None
        return ForkedProcess(pidfds[0], status, (FileIO(requests, "w"), FileIO(answers), FileIO(printed)))

    def close(self) -> None:
        """End the server, and with it all watchdogs that still run."""
        with self._lock:
            if self._process < 0:
                return
            process, self._process, self._lost = self._process, -1, True
            self._socket.close()
            if sys.platform == "linux":
                pidfd = os.pidfd_open(process)
                select.select([pidfd], [], [], PATIENCE_S)
                signal.pidfd_send_signal(pidfd, signal.SIGKILL)  # SIGKILL ends even a stopped process
                os.close(pidfd)
            os.waitpid(process, 0)


def _serve(requests: socket.socket, parent: int) -> NoReturn:
    """Fork watchdogs until the command ends."""
    code = 1
    try:
        _detach(requests.fileno())
        from carom.execution.workers.watchdog import PR_SET_PDEATHSIG, set_process_option

        set_process_option(PR_SET_PDEATHSIG, signal.SIGKILL)
        if os.getppid() == parent:
            _fork_watchdogs(requests)
        code = 0
    finally:  # this process must never return to the command's code, which it has copied
        os._exit(code)


def _detach(kept_file: int) -> None:
    """Detach this process from the command's terminal, signals and files. Only the file `kept_file` stays open."""
    gc.disable()  # otherwise this process could also run finalisers of the command's objects
    gc.freeze()
    os.setsid()
    signal.set_wakeup_fd(-1)
    for number in signal.valid_signals():
        if callable(signal.getsignal(number)):  # ignored signals stay ignored, as with `nohup`
            signal.signal(number, signal.SIG_DFL)
    null = os.open(os.devnull, os.O_RDWR)
    for stream in range(3):
        os.dup2(null, stream)
    os.closerange(3, kept_file)
    os.closerange(kept_file + 1, os.sysconf("SC_OPEN_MAX"))


def _fork_watchdogs(requests: socket.socket) -> None:
    """Fork a watchdog for each request, until the command closes its end of the socket."""
    signal.signal(signal.SIGCHLD, signal.SIG_DFL)  # if SIGCHLD were ignored, exit statuses would be lost
    watchdogs: dict[int, tuple[int, int]] = {}  # by pidfd: the watchdog's process number, and the pipe for its status
    poll = select.poll()
    poll.register(requests, select.POLLIN)
    while True:
        for file, _ in poll.poll():
            if file in watchdogs:
                poll.unregister(file)
                _report_end(*watchdogs.pop(file))
                os.close(file)
                continue
            message, files, _, _ = socket.recv_fds(requests, MOST_REQUEST_BYTES, _STREAMS)
            if not message:
                return
            watchdog = os.fork()
            if not watchdog:
                server_files = (requests.fileno(), *watchdogs, *(status_file for _, status_file in watchdogs.values()))
                _become_watchdog(message, files, server_files)
            pidfd = os.pidfd_open(watchdog) if sys.platform == "linux" else -1
            *streams, status_file = files
            watchdogs[pidfd] = (watchdog, status_file)
            poll.register(pidfd, select.POLLIN)
            socket.send_fds(requests, [b"."], [pidfd])
            for stream in streams:
                os.close(stream)


def _report_end(watchdog: int, status_file: int) -> None:
    """When a watchdog has ended, send its exit status to the command."""
    _, status = os.waitpid(watchdog, 0)
    with suppress(OSError):  # the command may have closed its end of the pipe
        os.write(status_file, array.array("i", [os.waitstatus_to_exitcode(status)]).tobytes())
    os.close(status_file)


def _become_watchdog(message: bytes, files: Sequence[int], server_files: Sequence[int]) -> NoReturn:
    """Turn this forked process into a watchdog. Both the watchdog and its worker end in this function."""
    code = 1
    try:
        server = os.getppid()
        folder, environment, memory_bytes = pickle.loads(message)  # noqa: S301 - sent by our own parent process
        os.setsid()
        *streams, status_file = files
        for number, file in enumerate(streams):
            os.dup2(file, number)
        for file in (*streams, status_file, *server_files):
            os.close(file)
        from carom.engines.registry import MANIFESTS, list_adapter_points

        path = environment["PYTHONPATH"].split(os.pathsep)
        if (path, environment.get(MANIFESTS)) != (list_search_path(), os.environ.get(MANIFESTS)):
            list_adapter_points.cache_clear()  # the search path may have changed since the server started
        os.chdir(folder)
        os.environ.clear()
        os.environ.update(environment)
        sys.path[:] = path
        sys.argv[:] = ["carom.execution.workers.watchdog", str(memory_bytes)]
        time.tzset()
        sys.stdin = sys.__stdin__ = open(0, closefd=False)  # type: ignore[misc] # noqa: SIM115 - to the end
        sys.stdout = sys.__stdout__ = open(1, "w", errors="backslashreplace", closefd=False)  # type: ignore[misc] # noqa: SIM115
        sys.stderr = sys.__stderr__ = open(2, "w", 1, errors="backslashreplace", closefd=False)  # type: ignore[misc] # noqa: SIM115
        from carom.execution.workers.watchdog import watch_worker

        gc.enable()
        watch_worker(server, memory_bytes)
        sys.stdout.flush()
        code = 0
    except SystemExit as end:
        code = end.code if isinstance(end.code, int) else int(end.code is not None)
    except BaseException:  # noqa: BLE001 - shown with its traceback, as in a new interpreter
        sys.excepthook(*sys.exc_info())
    finally:
        os._exit(code)
