"""Templates of engine programs and invalid requests: each line has one answer, and the next is as before."""

import json
import random
import select
import subprocess
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path
from typing import Any

import pytest
from tests.attacks.guard import spoil
from tests.unit.engines.protocol.programs import LANGUAGES, build_template
from tests.unit.engines.protocol.test_adapter import SESSION

#: So long may an answer take, in seconds: no request below asks for more than a few steps.
LIMIT_S = 60.0
LINES = 250

REQUESTS: list[dict[str, Any]] = [json.loads(line)[0] for line in SESSION.read_text(encoding="utf-8").splitlines()]


class Talk:
    """A program, and its answers line by line."""

    def __init__(self, command: list[str], folder: Path) -> None:
        self._process = subprocess.Popen(command, cwd=folder, bufsize=0, stdin=subprocess.PIPE, stdout=subprocess.PIPE)
        self._said = b""

    def ask(self, line: bytes) -> Any:
        """Return the answer to a line."""
        assert self._process.stdin
        assert self._process.stdout
        self._process.stdin.write(line + b"\n")
        while b"\n" not in self._said:
            ready, _, _ = select.select([self._process.stdout], [], [], LIMIT_S)
            assert ready, f"no answer to {line[:200]!r}"
            chunk = self._process.stdout.read(2**16)
            assert chunk, f"it ended over {line[:200]!r}"
            self._said += chunk
        answer, _, self._said = self._said.partition(b"\n")
        assert not self._said, f"more than one answer to {line[:200]!r}"
        return json.loads(answer)

    def close(self) -> None:
        """Let it end by the end of its input, as it must."""
        for pipe in (self._process.stdin, self._process.stdout):
            assert pipe
            pipe.close()
        self._process.wait(LIMIT_S)


@pytest.fixture(params=LANGUAGES)
def template(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[Talk]:
    """A template, built."""
    folder = build_template(request.param, tmp_path)
    started = {"javascript": ["node", "engine.mjs"]}.get(request.param, ["./engine"])
    with closing(Talk(started, folder)) as opened:
        yield opened


def mutate_request(rng: random.Random) -> bytes:
    """Return a request with something wrong with it."""
    request = rng.choice(REQUESTS)
    for _ in range(rng.choice((0, 1, 1, 2))):
        request = spoil(rng, request)
    # A request for many steps is sound, and takes them.
    if isinstance(request, dict) and request.get("steps", 1) not in range(9):
        request = {**request, "steps": 1}
    line = json.dumps(request, ensure_ascii=rng.random() < 0.5).encode(errors="surrogatepass").replace(b"\n", b" ")
    match rng.randrange(8):
        case 0:
            return line[: rng.randrange(len(line))]
        case 1:
            at = rng.randrange(len(line))
            return line[:at] + bytes([rng.choice(b'\x00\xff{}[]",:e-\\')]) + line[at + 1 :]
        case 2:
            return rng.choice((b"", b"null", b"[]", b"7", b'"step"', b"{", b"}", b"[" * 200_000, b'{"do":' * 50_000))
    return line


def test_template_answers_every_invalid_request(template: Talk) -> None:
    """A template answers each of 250 invalid or altered requests once, and then a sound session as recorded."""
    rng = random.Random(18)
    for _ in range(LINES):
        line = mutate_request(rng)
        answer = template.ask(line)
        assert isinstance(answer, dict), line[:200]
        if "error" in answer:
            assert answer["error"]["kind"] in {"refused", "failed"}, line[:200]
            assert isinstance(answer["error"]["message"], str), line[:200]
    world = 0
    for request, recorded in map(json.loads, SESSION.read_text(encoding="utf-8").splitlines()):
        answer = template.ask(json.dumps(request | ({"world": world} if "world" in request else {})).encode())
        world = answer.get("world", world)
        assert "error" not in answer
        for field in ("position_m", "velocity_m_s"):
            if field in recorded:
                for found, wanted in zip(answer[field], recorded[field], strict=True):
                    assert found == pytest.approx(wanted, abs=1e-12)
