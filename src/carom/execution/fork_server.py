"""A copy of the `carom` command, made before it opens anything, that forks worker processes with their imports done.

Importing NumPy, Pydantic and the seam takes a fresh interpreter longer than most runs last. The template is forked from
the main thread of the command before any other is started; it holds no file but null and its socket, no adapter and no
engine, and it never answers for one: each request is a keeper (`carom.execution.watchdog`) with streams, folder,
session, limits and environment of its own, as a fresh interpreter's. It ends with the command, and what it forked with
it.

Only the command `carom` on Linux has one. A process that is somebody else's, a notebook say, can have threads that no
fork survives: there each worker is a fresh interpreter, and so it is where the template gives no answer.
"""

from __future__ import annotations

import array
import os
import pickle
import select
import signal
import sys
import threading
import time
import warnings
from collections.abc import Sequence
from contextlib import suppress
from io import FileIO
from subprocess import TimeoutExpired
from typing import TYPE_CHECKING, NoReturn

if TYPE_CHECKING:
    import socket

#: The template answers by forking, which takes milliseconds; one that is stopped or gone is not waited for, seconds.
PATIENCE_S = 2.0
#: More than folder, path and environment take.
MOST_REQUEST_BYTES = 2**22
#: Of standard input, output and error of a keeper, and where its exit status is written.
_STREAMS = 4

_allowed = False


def allow_forking() -> None:
    """Let pools of this process fork their workers: it is the command `carom`, and starts all its threads itself."""
    global _allowed  # noqa: PLW0603 - a fact of the process
    _allowed = True


class ForkedProcess:
    """A keeper that the template has forked, with what `subprocess.Popen` offers of a process."""

    def __init__(self, pidfd: int, status: int, streams: tuple[FileIO, FileIO, FileIO]) -> None:
        self.stdin, self.stdout, self.stderr = streams
        self._pidfd, self._status = pidfd, status
        self._code: int | None = None

    def __del__(self) -> None:
        for file in (self._pidfd, self._status):
            os.close(file)

    def wait(self, timeout: float) -> int:
        """Return the exit code, as `subprocess.Popen.wait` does.

        Raises:
            subprocess.TimeoutExpired: It runs on after this many seconds.
        """
        if self._code is None:
            if not select.select([self._status], [], [], timeout)[0]:
                raise TimeoutExpired("carom.execution.watchdog", timeout)
            told = os.read(self._status, array.array("i", [0]).itemsize)
            # Nothing is told where the template was killed, and what it had forked with it.
            self._code = array.array("i", told)[0] if told else -signal.SIGKILL
        return self._code

    def send_signal(self, number: int) -> None:
        """Send a signal, if it still runs."""
        if sys.platform == "linux":
            with suppress(ProcessLookupError):
                signal.pidfd_send_signal(self._pidfd, number)

    def terminate(self) -> None:
        """Send SIGTERM."""
        self.send_signal(signal.SIGTERM)

    def kill(self) -> None:
        """Send SIGKILL."""
        self.send_signal(signal.SIGKILL)


class ForkServer:
    """The parent's side of a template."""

    def __init__(self, ours: socket.socket, process: int) -> None:
        self._socket, self._process = ours, process
        self._lock = threading.Lock()
        self._lost = False

    @classmethod
    def forked(cls) -> ForkServer | None:
        """Fork one; None where none may be: workers are fresh interpreters then."""
        known = sys.platform == "linux" and hasattr(os, "pidfd_open")
        if not (known and _allowed and threading.active_count() == 1):
            return None
        import socket

        ours, its = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        for stream in (sys.stdout, sys.stderr):
            stream.flush()  # or both would write what is in the buffer
        parent = os.getpid()
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", DeprecationWarning)  # of the threads of BLAS, which it takes care of itself
            child = os.fork()
        if not child:
            _serve(its, parent)
        its.close()
        ours.settimeout(PATIENCE_S)
        return cls(ours, child)

    def start(self, folder: str, path: str, memory_bytes: int) -> ForkedProcess | None:
        """Return a new keeper; None where the template is gone or gives no answer.

        Args:
            folder: Where it works.
            path: What its children find modules by, as the variable PYTHONPATH.
            memory_bytes: Most that its worker may take.
        """
        import socket

        with self._lock:
            if self._lost:
                return None
            (stdin, requests), (answers, stdout), (printed, stderr), (status, told) = (
                os.pipe() for _ in range(_STREAMS)
            )
            theirs = (stdin, stdout, stderr, told)
            pidfds: list[int] = []
            try:
                message = pickle.dumps((folder, {**os.environ, "PYTHONPATH": path}, memory_bytes))
                socket.send_fds(self._socket, [message], theirs)
                _, pidfds, _, _ = socket.recv_fds(self._socket, 1, 1)
            except OSError:
                pass
            finally:
                for file in theirs:
                    os.close(file)
            if not pidfds:
                self._lost = True
                for file in (requests, answers, printed, status):
                    os.close(file)
                return None
        return ForkedProcess(pidfds[0], status, (FileIO(requests, "w"), FileIO(answers), FileIO(printed)))

    def close(self) -> None:
        """End the template; keepers that still run end with it."""
        with self._lock:
            if self._process < 0:
                return
            process, self._process, self._lost = self._process, -1, True
            self._socket.close()
            if sys.platform == "linux":
                pidfd = os.pidfd_open(process)
                select.select([pidfd], [], [], PATIENCE_S)
                signal.pidfd_send_signal(pidfd, signal.SIGKILL)  # one that was stopped would never hear of it
                os.close(pidfd)
            os.waitpid(process, 0)


def _serve(requests: socket.socket, parent: int) -> NoReturn:
    """Fork keepers until the command is gone."""
    code = 1
    try:
        _let_go(requests.fileno())
        from carom.execution.watchdog import PR_SET_PDEATHSIG, on_linux

        on_linux(PR_SET_PDEATHSIG, signal.SIGKILL)
        if os.getppid() == parent:
            _Server(requests).serve()
        code = 0
    finally:  # whatever happens, this copy never goes on with what the command was doing
        os._exit(code)


def _let_go(kept: int) -> None:
    """Let go of what the command holds: its terminal, signals and files."""
    import gc

    gc.disable()  # and so no finalizer runs for what is the command's
    gc.freeze()
    os.setsid()
    signal.set_wakeup_fd(-1)
    for number in signal.valid_signals():
        if callable(signal.getsignal(number)):  # what is ignored stays so, as `nohup` has it
            signal.signal(number, signal.SIG_DFL)
    null = os.open(os.devnull, os.O_RDWR)
    for stream in range(3):
        os.dup2(null, stream)
    os.closerange(3, kept)
    os.closerange(kept + 1, os.sysconf("SC_OPEN_MAX"))


class _Server:
    """The template's own side."""

    def __init__(self, requests: socket.socket) -> None:
        self._requests = requests
        self._told: dict[int, int] = {}  # where the exit status of each keeper is written
        self._woken, wake = os.pipe()
        for file in (self._woken, wake):
            os.set_blocking(file, False)
        signal.set_wakeup_fd(wake, warn_on_full_buffer=False)
        self._wake = wake
        signal.signal(signal.SIGCHLD, lambda *_: None)

    def serve(self) -> None:
        """Fork until the other end is closed; then end what still runs."""
        import socket

        poll = select.poll()
        poll.register(self._requests, select.POLLIN)
        poll.register(self._woken, select.POLLIN)
        while True:
            ready = {file for file, _ in poll.poll()}
            if self._woken in ready:
                os.read(self._woken, select.PIPE_BUF)
                self._reap()
            if self._requests.fileno() in ready:
                message, files, _, _ = socket.recv_fds(self._requests, MOST_REQUEST_BYTES, _STREAMS)
                if not message:
                    self._reap()
                    return
                self._fork(message, files)

    def _fork(self, message: bytes, files: Sequence[int]) -> None:
        import socket

        keeper = os.fork()
        if not keeper:
            _keep(message, files, (self._requests.fileno(), self._woken, self._wake, *self._told.values()))
        pidfd = os.pidfd_open(keeper) if sys.platform == "linux" else -1
        *streams, self._told[keeper] = files
        socket.send_fds(self._requests, [b"."], [pidfd])
        for file in (*streams, pidfd):
            os.close(file)

    def _reap(self) -> None:
        with suppress(ChildProcessError):
            while True:
                keeper, status = os.waitpid(-1, os.WNOHANG)
                if not keeper:
                    return
                told = self._told.pop(keeper)
                with suppress(OSError):  # nobody waits for it any more
                    os.write(told, array.array("i", [os.waitstatus_to_exitcode(status)]).tobytes())
                os.close(told)


def _keep(message: bytes, files: Sequence[int], others: Sequence[int]) -> NoReturn:
    """Become a keeper, whose worker ends here when it has answered."""
    code = 1
    try:
        template = os.getppid()
        signal.set_wakeup_fd(-1)
        signal.signal(signal.SIGCHLD, signal.SIG_DFL)
        folder, environment, memory_bytes = pickle.loads(message)  # noqa: S301 - of our own parent process
        os.setsid()
        *streams, told = files
        for number, file in enumerate(streams):
            os.dup2(file, number)
        for file in (*streams, told, *others):
            os.close(file)
        os.chdir(folder)
        os.environ.clear()
        os.environ.update(environment)
        sys.path[:] = environment["PYTHONPATH"].split(os.pathsep)
        sys.argv[:] = ["carom.execution.watchdog", str(memory_bytes)]
        time.tzset()
        sys.stdin = sys.__stdin__ = open(0, closefd=False)  # type: ignore[misc] # noqa: SIM115 - to the end
        sys.stdout = sys.__stdout__ = open(1, "w", errors="backslashreplace", closefd=False)  # type: ignore[misc] # noqa: SIM115
        sys.stderr = sys.__stderr__ = open(2, "w", 1, errors="backslashreplace", closefd=False)  # type: ignore[misc] # noqa: SIM115
        import gc

        from carom.execution.watchdog import keep

        gc.enable()
        keep(template, memory_bytes)
        sys.stdout.flush()
        code = 0
    except SystemExit as end:
        code = end.code if isinstance(end.code, int) else int(end.code is not None)
    except BaseException:  # noqa: BLE001 - as a fresh interpreter would tell of it
        sys.excepthook(*sys.exc_info())
    finally:
        os._exit(code)
