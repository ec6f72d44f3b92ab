"""The templates, sent what no harness would send: each line has one answer, and the next is as before."""

import copy
import json
import random
import select
import subprocess
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path
from typing import Any

import pytest
from tests.unit.engines.protocol.programs import LANGUAGES, build_template
from tests.unit.engines.protocol.test_adapter import SESSION

#: So long may an answer take, in seconds: no request below asks for more than a few steps.
LIMIT_S = 60.0
LINES = 250

REQUESTS: list[dict[str, Any]] = [json.loads(line)[0] for line in SESSION.read_text(encoding="utf-8").splitlines()]

#: What takes the place of any value. No number of steps among them takes long.
NUMBERS = [-1, 0, 3, 0.5, 1e300, -1e-300, 2**40]
ODD: list[Any] = [None, True, *NUMBERS, "", "inf", "é\n", "\ud800", [], [0], [[1], [2]], {}, {"do": 1}]


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


def list_places(value: Any) -> Iterator[tuple[Any, Any]]:
    """Yield the place of each value within one: its container, and its key there."""
    keys = value.keys() if isinstance(value, dict) else range(len(value)) if isinstance(value, list) else ()
    for key in list(keys):
        yield value, key
        yield from list_places(value[key])


def mutate_request(chance: random.Random) -> bytes:
    """Return a request with something wrong with it."""
    request = copy.deepcopy(chance.choice(REQUESTS))
    for _ in range(chance.choice((0, 1, 1, 2))):
        holder, key = chance.choice(list(list_places(request)))
        if chance.random() < 0.3:
            del holder[key]
        else:
            holder[key] = chance.choice(ODD)
    # A request for many steps is sound, and takes them.
    if request.get("steps") == "inf" or (
        isinstance(request.get("steps"), int | float) and request["steps"] not in range(9)
    ):
        request["steps"] = 1
    line = json.dumps(request, ensure_ascii=chance.random() < 0.5).encode(errors="surrogatepass").replace(b"\n", b" ")
    match chance.randrange(8):
        case 0:
            return line[: chance.randrange(len(line))]
        case 1:
            at = chance.randrange(len(line))
            return line[:at] + bytes([chance.choice(b'\x00\xff{}[]",:e-\\')]) + line[at + 1 :]
        case 2:
            return chance.choice((b"", b"null", b"[]", b"7", b'"step"', b"{", b"}", b"[" * 200_000, b'{"do":' * 50_000))
    return line


@pytest.mark.long
@pytest.mark.parametrize("template", ["cpp", "rust"], indirect=True)
def test_template_names_a_missing_setting(template: Talk) -> None:
    """If a request lacks the setting `dt_s`, the template's error message names it."""
    prepare = next(request for request in REQUESTS if request["do"] == "prepare")
    assert "there is no dt_s" in template.ask(json.dumps(prepare | {"settings": {}}).encode())["error"]["message"]


def test_template_answers_every_invalid_request(template: Talk) -> None:
    """A template answers each of 250 invalid or altered requests once, and then a sound session as recorded."""
    chance = random.Random(18)
    for _ in range(LINES):
        line = mutate_request(chance)
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
