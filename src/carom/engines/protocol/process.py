"""The program while it runs: one request, one answer, and its last words where there is none."""

from __future__ import annotations

import json
import os
import select
import subprocess
from collections.abc import Sequence
from pathlib import Path
from typing import IO, TypeVar

from pydantic import BaseModel, ValidationError

from carom.engines.protocol.messages import PROTOCOL, Hello, Reply, Request, Welcome
from carom.errors import AdapterError, InputError
from carom.support.data_files import without_doubles
from carom.support.escaping import last_words
from carom.support.fields import said_of

#: A million discs with their contacts take half of this; longer answers are refused.
MOST_ANSWER_BYTES = 256 * 2**20
#: Characters that are shown of an answer that can't be read.
SHOWN = 120
#: Of what the program prints on standard error the end is kept; its last words go into the reason of a failure.
MOST_PRINTED_BYTES = 2**14
#: What a pipe holds by default on Linux.
CHUNK_BYTES = 2**16
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
                list(command), stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE, bufsize=0
            )
        except OSError as error:
            raise AdapterError(f"{name}: {' '.join(command)} can't be started: {error.strerror}") from error
        self._requests, self._answers, self._printed = _pipes(self._popen)
        self._poll = select.poll()
        for pipe in (self._answers, self._printed):
            self._poll.register(pipe, select.POLLIN)
        for pipe in (self._requests, self._answers, self._printed):
            os.set_blocking(pipe.fileno(), False)
        self._answered, self._words = bytearray(), b""
        welcome = self.ask(Hello(), Welcome)
        if welcome.protocol != PROTOCOL:
            self.end()
            message = f"{name} speaks version {welcome.protocol} of the protocol, and Carom version {PROTOCOL}"
            raise AdapterError(message, hints=["see docs/reference/engine-protocol.md"])
        self.version = welcome.version

    def ask(self, request: Request, answer: type[A]) -> A:
        """Return the answer to a request.

        Raises:
            AdapterError: The program refuses, fails, ends, or answers something else.
        """
        if self._requests.closed:
            raise AdapterError(f"{self.name}: its program has ended and cannot answer {request.do!r}")
        self._words = b""
        line = self._exchange(request.model_dump_json().encode() + b"\n")
        if line is None:
            raise AdapterError(f"{self.name}: {self._obituary()} when asked to {request.do!r}")
        self._require_single_keys(line, request)
        try:
            if (error := Reply.model_validate_json(line).error) is not None:
                said = self._last_said() if error.kind == "failed" else ""
                raise AdapterError(f"{self.name} {error.kind} {request.do!r}: {error.message}{said and f'; {said}'}")
            return answer.model_validate_json(line, strict=True)
        except ValidationError as error:
            wrong = error.errors(include_url=False)[0]
            field = ".".join(map(str, wrong["loc"])) or "the line"
            said = (
                "is no JSON, and standard output is for answers alone"
                if wrong["type"] == "json_invalid"
                else said_of(wrong)
            )
            told = f"{self.name} answered {request.do!r} with nonsense: {field} {said}; it wrote {line[:SHOWN]!r}"
            raise AdapterError(told, hints=["see docs/reference/engine-protocol.md#the-requests"]) from error

    def _require_single_keys(self, line: bytes, request: Request) -> None:
        """Refuse an answer that has a key twice: what reads it would take one of the two, and not say which."""
        try:
            json.loads(line, object_pairs_hook=without_doubles)
        except InputError as error:
            told = f"{self.name} answered {request.do!r} with nonsense: the line {error}; it wrote {line[:SHOWN]!r}"
            raise AdapterError(told, hints=["see docs/reference/engine-protocol.md#the-requests"]) from error
        except (ValueError, RecursionError):
            return  # what is no JSON is told by what reads it

    def _exchange(self, request: bytes) -> bytes | None:
        """Send a request and return the line that answers it; None where there is none.

        What is printed is taken in all the while: a program whose standard error nobody reads stops at a full pipe.
        """
        unsent, searched = memoryview(request), 0
        self._poll.register(self._requests, select.POLLOUT)
        while (end := self._answered.find(b"\n", searched)) < 0:
            searched = len(self._answered)
            if searched > MOST_ANSWER_BYTES:
                return None
            for file, _ in self._poll.poll():
                if file == self._requests.fileno():
                    try:
                        unsent = unsent[os.write(file, unsent) :]
                    except BrokenPipeError:  # it has closed its input, or ended; the end of its answers says which
                        unsent = unsent[:0]
                    if not unsent:
                        self._poll.unregister(file)
                elif file == self._printed.fileno():
                    if not self._take_words():
                        self._poll.unregister(file)
                elif chunk := os.read(file, CHUNK_BYTES):
                    self._answered += chunk
                else:
                    return None
        line = bytes(self._answered[:end])
        del self._answered[: end + 1]
        if unsent:  # it has answered before it was asked
            self._poll.unregister(self._requests)
        return line

    def _take_words(self) -> bool:
        """Keep the end of what is printed now; whether more may come."""
        try:
            chunk = os.read(self._printed.fileno(), CHUNK_BYTES)
        except BlockingIOError:
            return False
        self._words = (self._words + chunk)[-MOST_PRINTED_BYTES:]
        return bool(chunk)

    def _last_said(self) -> str:
        """Return what it has last printed since it was last asked, in a phrase; empty where that is nothing."""
        while self._take_words():
            pass
        # A worker's folder has another name each time; without it one reason is one.
        said = last_words(self._words.decode(errors="replace").replace(f"{Path.cwd()}{os.sep}", ""))
        return f"it last printed {said!r}" if said else ""

    def _obituary(self) -> str:
        """End what is left of the program, and return how it ended and what it last printed."""
        by_itself = self._stop()
        said = self._last_said()
        self.end()
        code = self._popen.returncode
        if len(self._answered) > MOST_ANSWER_BYTES:
            how = f"it answered more than {MOST_ANSWER_BYTES >> 20} MiB in a line"
        elif by_itself and code:
            how = f"its program was ended by signal {-code}" if code < 0 else f"its program ended with exit code {code}"
        else:
            how = "it closed its output"
        return f"{how}, {said}," if said else how

    @property
    def ended(self) -> bool:
        """Whether it no longer answers."""
        return self._popen.poll() is not None

    def end(self) -> None:
        """Tell it to end, by the end of its input; one that does not is killed."""
        self._stop()
        for pipe in (self._answers, self._printed):
            pipe.close()

    def _stop(self) -> bool:
        """End its input, and kill it where it does not end then; whether it ended by itself."""
        self._requests.close()
        try:
            self._popen.wait(GRACE_S)
        except subprocess.TimeoutExpired:
            self._popen.kill()
            self._popen.wait(GRACE_S)
            return False
        return True


def _pipes(popen: subprocess.Popen[bytes]) -> tuple[IO[bytes], IO[bytes], IO[bytes]]:
    if popen.stdin is None or popen.stdout is None or popen.stderr is None:
        raise AdapterError("a program was started without pipes")  # can't be: all three were asked for
    return popen.stdin, popen.stdout, popen.stderr
