"""Engine programs whose answers are spoilt, and `carom serve` given spoilt requests: a row or an answer for each.

A program gets a row that says what it did, and costs no other row. `carom serve` answers each line with one of JSON.
"""

import os
import sys
from collections.abc import Iterator
from contextlib import closing
from functools import partial
from pathlib import Path
from random import Random
from unittest import mock

import pytest
from tests.attacks.guard import check_strict_json, try_act
from tests.processes import PATIENT_S, limit_only
from tests.unit.engines.protocol.programs import Talk, write_manifest
from tests.unit.engines.protocol.test_template_fuzz import mutate_request

from carom import Disc, Scene, cross_check
from carom.engines.registry import MANIFESTS, list_adapter_points
from carom.execution.job import Status
from carom.execution.pool import LocalPool
from carom.report.results_file.results_jsonl import format_records

#: Requests of one `carom serve`.
SESSION = 200
LIMIT_S = 20.0
SCENE = Scene(name="one", discs=[Disc(position_m=(0.0, 0.0), radius_m=1.0)], duration_s=0.5)
#: What a program may do instead of an answer, or to one. Each is a line before `print(json.dumps(answer), ...)`.
ACTS = (
    *("sys.exit(0)", "sys.exit(3)", "import os; os.abort()", "import os; os.kill(os.getpid(), 9)"),
    "raise ValueError('x' * 10**6)",
    *("print('hello')", "print('{}')", "print('null')", "print('[' * 10**6)", "sys.stdout.write('x' * 10**7)"),
    "print()",
    *("sys.stdout.buffer.write(b'\\xff\\xfe\\n')", "sys.stdout.close()", "sys.stdin.close()"),
    "sys.stderr.write('\\x1b[31m' * 10**5)",
    "print(json.dumps(answer))",
    "print(json.dumps({'error': {'kind': 'refused', 'message': '\\x1b[31m\\u202e' * 999}}))",
    *("import os; os.close(1)", "import os; os.close(0)", "import os; os.fork()", "import time; time.sleep(3600)"),
    *("answer = [answer]", "answer = None", "answer['error'] = 5", "answer['error'] = {'message': None}"),
    "answer = {'error': {}}",
)
#: What replaces a value of an answer.
VALUES = (
    *("None", "True", "-1", "0", "1e308", "float('nan')", "float('inf')", "'inf'", "''", "'x' * 10**6", "[]", "[[]]"),
    *("{}", "10**400", "[[0, 0]] * 10**5", "[None]", "[['0', 0]]", "[[1e308, 1e308]]", "[[0, 0], [0, 0]]", "2**63"),
    "[{'first': 0, 'second': 5, 'time_s': 0, 'normal': [1, 0]}]",
    "[{'first': 0, 'second': 0, 'time_s': 0, 'normal': [0, 0]}]",
)
FIELDS = (
    *("protocol", "version", "world", "settings", "seconds", "position_m", "velocity_m_s", "spin_rad_s", "contacts"),
    *("warning", "pairs", "state"),
)


def attack(rng: Random, folder: Path) -> Iterator[str]:
    """Wrong answers of engine programs, wrong requests to `carom serve`.

    The program's result is true, other results do not change, and each line gets an answer.
    """
    folder.joinpath("program").mkdir(exist_ok=True)
    while True:
        yield _try_program(rng, folder / "program")
        yield from _try_serve(rng, folder)


def _try_program(rng: Random, folder: Path) -> str:
    """Return what is lost after a cross-check with a program that does one thing to one kind of answer."""
    when = rng.choice(("hello", "prepare", "step", "observe", "close"))
    act = rng.choice(ACTS) if rng.random() < 0.5 else f"answer[{rng.choice(FIELDS)!r}] = {rng.choice(VALUES)}"
    manifest = write_manifest(folder, f"if do == {when!r}: {act}")
    lost = try_act(partial(_find_loss, manifest), limit_s=4.0 * PATIENT_S, busy=1.0)
    list_adapter_points.cache_clear()
    return lost and f"at {when}: {act}: {lost}"


def _find_loss(manifest: Path) -> str:
    with (
        pytest.MonkeyPatch.context() as patch,
        mock.patch.dict(os.environ, {MANIFESTS: ""}),
        LocalPool(2, LIMIT_S, memory_limit_mb=1500) as pool,
    ):
        limit_only(patch, "toy")
        engines = ["pit", str(manifest)]
        results = cross_check([SCENE], engines, dts=[0.1], profiles=["tuned"], timing=False, pool=pool)
    pit, toy = results.rows
    if pit.status is not Status.RAN or (toy.status is not Status.RAN and not toy.reason):
        return f"rows {pit.status} {pit.reason[:300]!r}, {toy.status} {toy.reason[:300]!r}"
    check_strict_json(format_records(results))
    return ""


def _try_serve(rng: Random, folder: Path) -> Iterator[str]:
    """Yield what is lost over each line of a session of `carom serve`."""
    with closing(Talk([sys.executable, "-m", "carom", "serve", "pit"], folder)) as talk:
        for _ in range(SESSION):
            line = mutate_request(rng)
            try:
                answer = talk.ask(line)
            except (AssertionError, ValueError, OSError) as error:
                yield f"carom serve, asked {line[:300]!r}: {str(error)[:300]}"
                return
            yield "" if isinstance(answer, dict) else f"carom serve, asked {line[:300]!r}: {answer!r}"
