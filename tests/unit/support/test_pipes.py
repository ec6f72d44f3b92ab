"""What a child process writes and reads in parts arrives whole, in both directions."""

import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager

import pytest
from tests.processes import PATIENT_S

from carom.execution.workers import worker_process
from carom.execution.workers.worker_process import SHOWN_BYTES, _Process
from carom.support.pipes import LinePipes

#: More than a pipe holds.
LONG = b"x" * 2**18 + b"\n"


@contextmanager
def start_program(source: str) -> Iterator[subprocess.Popen[bytes]]:
    words = [sys.executable, "-c", f"import sys\nread, write = sys.stdin.readline, sys.stdout.write\n{source}"]
    with subprocess.Popen(words, stdin=-1, stdout=-1, stderr=-1, bufsize=0) as program:
        try:
            yield program
        finally:
            program.kill()


def receive_line(pipes: LinePipes) -> bytes | None:
    while (line := pipes.take_line()) is None and not pipes.has_ended:
        pipes.exchange(PATIENT_S)
    return line


def test_early_answer_does_not_cut_the_request() -> None:
    """A program that answers before it has read the whole request gets the rest with the next request."""
    source = "print('early', flush=True)\nprint(len(read()), read().strip())"
    with start_program(source) as program:
        pipes = LinePipes(program.stdin, program.stdout, program.stderr, 100)
        pipes.send(LONG)
        assert receive_line(pipes) == b"early"
        pipes.send(b"next\n")
        assert receive_line(pipes) == f"{len(LONG)} next".encode()
        assert receive_line(pipes) is None
        pipes.close()


def test_unread_request_and_incomplete_line_end_the_exchange() -> None:
    """A program that ends without reading its request, within a line, gives no line; its last output is kept."""
    source = "write('half a line')\nsys.stderr.write('word ' * 10_000 + 'last')"
    with start_program(source) as program:
        pipes = LinePipes(program.stdin, program.stdout, program.stderr, 9)
        pipes.send(LONG)
        assert receive_line(pipes) is None
        assert (bytes(pipes.answered), pipes.read_printed()) == (b"half a line", b"word last")
        pipes.close()
        pipes.close()


def test_answer_before_an_endless_line_is_received(monkeypatch: pytest.MonkeyPatch) -> None:
    """A worker's complete answer is received, even if more than an answer's largest size follows it."""
    monkeypatch.setattr(worker_process, "MOST_ANSWER_BYTES", 1000)
    code = "import sys; sys.stdin.read(1); print('answer'); print('x' * 2000, end='', flush=True); sys.stdin.read()"
    started = subprocess.Popen([sys.executable, "-c", code], stdin=-1, stdout=-1, stderr=-1, bufsize=0)
    monkeypatch.setattr(worker_process, "_start_watchdog", lambda *_: started)
    process = _Process("", 0, None)
    process.send(b".")
    while len(process.answered) < 2000:
        process.exchange(PATIENT_S)
    assert process.take_line() == b"answer"
    assert process.take_line() == b"x" * 2 * SHOWN_BYTES
    process.end()
