"""Templates of engine programs and invalid requests: each line has one answer, and the next is as before."""

import json
import random
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path
from typing import Any

import pytest
from tests.attacks.guard import spoil
from tests.unit.engines.protocol.programs import LANGUAGES, Talk, build_template
from tests.unit.engines.protocol.test_adapter import SESSION

LINES = 250

REQUESTS: list[dict[str, Any]] = [json.loads(line)[0] for line in SESSION.read_text(encoding="utf-8").splitlines()]


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
    """A template answers each of 250 invalid or altered requests once, and then a sound one."""
    rng = random.Random(18)
    for _ in range(LINES):
        line = mutate_request(rng)
        answer = template.ask(line)
        assert isinstance(answer, dict), line[:200]
        if "error" in answer:
            assert answer["error"]["kind"] in {"refused", "failed"}, line[:200]
            assert isinstance(answer["error"]["message"], str), line[:200]
    assert "error" not in template.ask(b'{"do": "hello"}')
