"""Runs the program of an engine: sends requests, receives answers, and describes how the program has failed."""

from __future__ import annotations

import json
import os
import subprocess
from collections.abc import Sequence
from pathlib import Path
from typing import TypeVar

from pydantic import BaseModel, ValidationError

from carom.engines.protocol.messages import PROTOCOL, Hello, Reply, Request, Welcome
from carom.errors import AdapterError, InputError
from carom.support.data_files import reject_duplicate_keys
from carom.support.escaping import find_last_message
from carom.support.fields import describe_error
from carom.support.pipes import LinePipes

#: Largest size of an answer. An answer with a million discs and their contacts has half of this size.
MOST_ANSWER_BYTES = 256 * 2**20
#: Number of characters of an invalid answer that a message shows.
SHOWN = 120
#: Number of bytes that are kept from the end of standard error. The last line appears in the message about a failure.
MOST_PRINTED_BYTES = 2**14
#: Seconds within which a program must end after its input was closed.
GRACE_S = 2.0

A = TypeVar("A", bound=BaseModel)


class Program:
    """A running program that has answered the first request.

    Args:
        name: Name of the program in messages.
        command: The command that starts the program. The first word is searched on the PATH.

    Raises:
        AdapterError: The program can't be started, or violates the protocol.
    """

    def __init__(self, name: str, command: Sequence[str]) -> None:
        self.name = name
        try:
            self._popen = subprocess.Popen(  # noqa: S603 - the user has named the manifest to start its program
                list(command), stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE, bufsize=0
            )
        except OSError as error:
            raise AdapterError(f"{name}: {' '.join(command)} can't be started: {error.strerror}") from error
        self._pipes = LinePipes(self._popen.stdin, self._popen.stdout, self._popen.stderr, MOST_PRINTED_BYTES)
        welcome = self.send_request(Hello(), Welcome)
        if welcome.protocol != PROTOCOL:
            self.end()
            message = f"{name} uses version {welcome.protocol} of the protocol, but Carom uses version {PROTOCOL}"
            raise AdapterError(message, hints=["see docs/reference/engine-protocol.md"])

    def send_request(self, request: Request, answer: type[A]) -> A:
        """Send a request and return its answer.

        Raises:
            AdapterError: The program refuses the request, fails or ends, or its answer is invalid.
        """
        if self._pipes.requests.closed:
            raise AdapterError(f"{self.name}: its program has ended and cannot answer {request.do!r}")
        self._pipes.printed = b""
        line = self._exchange(request.model_dump_json().encode() + b"\n")
        if line is None:
            raise AdapterError(f"{self.name}: {self._describe_end()} when asked to {request.do!r}")
        try:
            # By default, `json` silently keeps only one value of a duplicate key.
            json.loads(line, object_pairs_hook=reject_duplicate_keys)
        except InputError as error:
            raise self._build_answer_error(request, line, f"the line {error}") from error
        except (ValueError, RecursionError):
            pass  # invalid JSON is reported below
        try:
            if (failure := Reply.model_validate_json(line).error) is not None:
                detail = self._describe_last_output() if failure.kind == "failed" else ""
                raise AdapterError(
                    f"{self.name} {failure.kind} {request.do!r}: {failure.message}{detail and f'; {detail}'}"
                )
            return answer.model_validate_json(line, strict=True)
        except ValidationError as error:
            wrong = error.errors(include_url=False)[0]
            field = ".".join(map(str, wrong["loc"])) or "the line"
            detail = describe_error(wrong)
            if wrong["type"] == "json_invalid":
                detail = "is not JSON; standard output must contain only answers"
            raise self._build_answer_error(request, line, f"{field} {detail}") from error

    def _build_answer_error(self, request: Request, line: bytes, problem: str) -> AdapterError:
        message = f"{self.name} sent an invalid answer to {request.do!r}: {problem}; it wrote {line[:SHOWN]!r}"
        return AdapterError(message, hints=["see docs/reference/engine-protocol.md#the-requests"])

    def _exchange(self, request: bytes) -> bytes | None:
        """Send a request and return the answer as a line; None if there is no answer."""
        self._pipes.send(request)
        while (line := self._pipes.take_line()) is None:
            if self._pipes.has_ended or self._has_answered_too_much:
                return None
            self._pipes.exchange()
        return line

    @property
    def _has_answered_too_much(self) -> bool:
        return len(self._pipes.answered) > MOST_ANSWER_BYTES

    def _describe_last_output(self) -> str:
        """Return a phrase with the last line that the program printed since the last request.

        The phrase is empty if the program printed nothing.
        """
        printed = self._pipes.read_printed().decode(errors="replace")
        # Remove the path of the worker's temporary folder, so that the same failure always has the same text.
        last_output = find_last_message(printed.replace(f"{Path.cwd()}{os.sep}", ""))
        return f"it last printed {last_output!r}" if last_output else ""

    def _describe_end(self) -> str:
        """End the program. Return how the program ended, and its last output."""
        by_itself = self._stop()
        last_output = self._describe_last_output()
        self.end()
        code = self._popen.returncode
        if self._has_answered_too_much:
            how = f"it answered with a line of more than {MOST_ANSWER_BYTES >> 20} MiB"
        elif by_itself and code:
            how = f"its program was ended by signal {-code}" if code < 0 else f"its program ended with exit code {code}"
        else:
            how = "it closed its output"
        return f"{how}, {last_output}," if last_output else how

    @property
    def ended(self) -> bool:
        """Whether the program has ended."""
        return self._popen.poll() is not None

    def end(self) -> None:
        """Close the program's input, which should end the program. If the program does not end, kill it."""
        self._stop()
        self._pipes.close()

    def _stop(self) -> bool:
        """Close the program's input, and kill the program if it does not end.

        Return whether the program ended by itself.
        """
        self._pipes.close_requests()
        try:
            self._popen.wait(GRACE_S)
        except subprocess.TimeoutExpired:
            self._popen.kill()
            self._popen.wait()  # no process can ignore SIGKILL, but its end can take a while
            return False
        return True
