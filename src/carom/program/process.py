"""The program while it runs: one request, one answer, and its last words where there is none."""

from __future__ import annotations

import subprocess
import threading
from collections import deque
from collections.abc import Sequence
from contextlib import suppress
from typing import IO, TypeVar

from pydantic import BaseModel, ValidationError

from carom.errors import AdapterError
from carom.program.messages import PROTOCOL, Hello, Reply, Request, Welcome

__all__ = ["Program"]

#: A million discs with their contacts take half of this; a longer answer is none.
MOST_ANSWER_BYTES = 256 * 2**20
#: Characters that are shown of an answer that can't be read.
SHOWN = 120
#: Lines kept of what the program prints on standard error; the last one goes into the reason of its end.
LINES_KEPT = 20
#: Characters of such a line that are kept.
MOST_LINE = 300
#: A program that has been told to end, by the end of its input, has so long for it, seconds.
GRACE_S = 2.0

A = TypeVar("A", bound=BaseModel)


class Program:
    """A program that has been started and has said hello.

    Args:
        name: What messages call it.
        command: The command, its first word looked for on the PATH.

    Attributes:
        version: The version that it says its engine has; may be empty.

    Raises:
        AdapterError: It can't be started, or does not answer as the protocol says.
    """

    def __init__(self, name: str, command: Sequence[str]) -> None:
        self.name = name
        try:
            self._popen = subprocess.Popen(  # noqa: S603 - to start it is what the manifest was named for
                list(command), stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE
            )
        except OSError as error:
            raise AdapterError(f"{name}: {' '.join(command)} can't be started: {error.strerror}") from error
        self._requests, self._answers, printed = _pipes(self._popen)
        self._printed: deque[str] = deque(maxlen=LINES_KEPT)
        self._listener = threading.Thread(target=self._listen, args=(printed,), daemon=True)
        self._listener.start()
        welcome = self.ask(Hello(), Welcome)
        if welcome.protocol != PROTOCOL:
            self.end()
            message = f"{name} speaks version {welcome.protocol} of the protocol, and Carom version {PROTOCOL}"
            raise AdapterError(f"{message}; see docs/engine-protocol.md")
        self.version = welcome.version

    def _listen(self, printed: IO[bytes]) -> None:
        """Keep the end of what is printed; a program whose standard error nobody reads would stop at a full pipe."""
        with printed:
            while line := printed.readline(MOST_LINE):
                if text := line.decode(errors="replace").strip():
                    self._printed.append(text)

    def ask(self, request: Request, answer: type[A]) -> A:
        """Return the answer to a request.

        Raises:
            AdapterError: The program refuses, fails, ends, or answers something else.
        """
        try:
            self._requests.write(request.model_dump_json().encode() + b"\n")
            self._requests.flush()
            line = self._answers.readline(MOST_ANSWER_BYTES)
        except OSError:  # its end of the pipe is closed
            line = b""
        if not line.endswith(b"\n"):
            raise AdapterError(f"{self.name}: {self._obituary(line)} when asked to {request.do!r}")
        try:
            if (error := Reply.model_validate_json(line).error) is not None:
                raise AdapterError(f"{self.name} {error.kind} {request.do!r}: {error.message}")
            return answer.model_validate_json(line, strict=True)
        except ValidationError as error:
            wrong = error.errors(include_url=False)[0]
            field = ".".join(map(str, wrong["loc"])) or "the line"
            told = f"{self.name} answered {request.do!r} with nonsense: {field}: {wrong['msg']}"
            raise AdapterError(f"{told}; it wrote {line[:SHOWN]!r}") from error

    def _obituary(self, begun: bytes) -> str:
        """End what is left of the program, and return how it ended and what it last printed."""
        if len(begun) == MOST_ANSWER_BYTES:
            how = f"it answered more than {MOST_ANSWER_BYTES >> 20} MiB in a line"
        else:
            how = "it closed its output"
        self.end()
        code = self._popen.returncode
        if code:
            how = f"its program was ended by signal {-code}" if code < 0 else f"its program ended with exit code {code}"
        return f"{how}, last printing {self._printed[-1]!r}," if self._printed else how

    @property
    def ended(self) -> bool:
        """Whether it no longer answers."""
        return self._popen.poll() is not None

    def end(self) -> None:
        """Tell it to end, by the end of its input; one that does not is killed."""
        with suppress(OSError):  # what was not yet written can't be
            self._requests.close()
        try:
            self._popen.wait(GRACE_S)
        except subprocess.TimeoutExpired:
            self._popen.kill()
            self._popen.wait(GRACE_S)
        self._listener.join(GRACE_S)
        self._answers.close()


def _pipes(popen: subprocess.Popen[bytes]) -> tuple[IO[bytes], IO[bytes], IO[bytes]]:
    if popen.stdin is None or popen.stdout is None or popen.stderr is None:
        raise AdapterError("a program was started without pipes")  # can't be: all three were asked for
    return popen.stdin, popen.stdout, popen.stderr
