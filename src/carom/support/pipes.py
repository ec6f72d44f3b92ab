"""Pipes to a child process that writes each answer as a line."""

from __future__ import annotations

import os
import select
from typing import IO

#: Default capacity of a pipe on Linux, and the largest capacity.
CHUNK_BYTES = 2**16
MOST_PIPE_BYTES = 2**20


class LinePipes:
    """Standard input, output and error of a child process.

    The three pipes are read and written together, because a full pipe would block the process.

    Args:
        requests: The standard input of the process.
        answers: The standard output of the process.
        printed: The standard error of the process.
        kept_bytes: Number of bytes that are kept from the end of standard error.

    Attributes:
        requests: The standard input of the process.
        answered: Received bytes that `take_line` has not returned yet.
        printed: The last bytes of standard error that were received.
        has_ended: Whether the process has closed its standard output, so that no further answer can come.
    """

    def __init__(
        self, requests: IO[bytes] | None, answers: IO[bytes] | None, printed: IO[bytes] | None, kept_bytes: int
    ) -> None:
        assert requests and answers and printed  # noqa: S101, PT018 - all three are pipes, since the process was started so
        self.requests, self._pipes, self._kept_bytes = requests, (requests, answers, printed), kept_bytes
        self._requests, self._answers = requests.fileno(), answers.fileno()
        self._poll = select.poll()
        for pipe in self._pipes:
            os.set_blocking(pipe.fileno(), False)
        for pipe in (answers, printed):
            self._poll.register(pipe, select.POLLIN)
        self.answered, self.printed, self.has_ended = bytearray(), b"", False
        self._unsent, self._searched = memoryview(b""), 0

    def send(self, message: bytes) -> None:
        """Queue a message; `exchange` sends the message."""
        self._unsent = memoryview(bytes(self._unsent) + message)
        self._poll.register(self._requests, select.POLLOUT)

    def take_line(self) -> bytes | None:
        """Return the next line of the answers, without line feed; None if no line is complete yet."""
        end = self.answered.find(b"\n", self._searched)
        if end < 0:
            self._searched = len(self.answered)
            return None
        line = bytes(self.answered[:end])
        del self.answered[: end + 1]
        self._searched = 0
        return line

    def exchange(self, wait_s: float | None = None) -> None:
        """Wait until data can be sent or received, and send and receive what is possible.

        `wait_s` limits the wait, in seconds.
        """
        for file, _ in self._poll.poll(None if wait_s is None else 1000.0 * wait_s):
            try:
                if file == self._requests:
                    self._unsent = self._unsent[os.write(file, self._unsent) :]
                    if not self._unsent:
                        self._poll.unregister(file)
                elif not (chunk := os.read(file, CHUNK_BYTES)):
                    self._poll.unregister(file)
                    self.has_ended |= file == self._answers
                elif file == self._answers:
                    self.answered += chunk
                else:
                    self.keep_printed(chunk)
            except BlockingIOError:
                pass
            except BrokenPipeError:  # the process has closed its input or ended; its missing answer is reported later
                self._drop_unsent()

    def keep_printed(self, chunk: bytes) -> None:
        """Keep received bytes of standard error, and forget the oldest bytes."""
        self.printed = (self.printed + chunk)[-self._kept_bytes :]

    def read_printed(self) -> bytes:
        """Receive everything that the process has printed, and return the last bytes."""
        for _ in range(MOST_PIPE_BYTES // CHUNK_BYTES):
            self.exchange(0)
        return self.printed

    def close_requests(self) -> None:
        """Close the standard input of the process."""
        if self._unsent:
            self._drop_unsent()
        self.requests.close()

    def close(self) -> None:
        """Close all pipes."""
        self.close_requests()
        for pipe in self._pipes:
            pipe.close()

    def _drop_unsent(self) -> None:
        self._unsent = memoryview(b"")
        self._poll.unregister(self._requests)
