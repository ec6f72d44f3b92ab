"""Engine programs whose answers are spoilt, and `carom serve` given spoilt requests: a row or an answer for each.

A program gets a row that says what it did, and costs no other row. `carom serve` answers each line with one of JSON.
"""

import json
import os
import sys
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path
from random import Random
from unittest import mock

import pytest
from tests.attacks.guard import HangError, limit_time
from tests.processes import PATIENT_S, limit_only
from tests.unit.engines.protocol.programs import write_manifest
from tests.unit.engines.protocol.test_template_fuzz import Talk, mutate_request

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
    """Run a program that spoils some of its answers next to PIT, and serve PIT to spoilt requests."""
    folder.joinpath("program").mkdir(exist_ok=True)
    while True:
        yield _try_program(rng, folder / "program")
        yield from _try_serve(rng, folder)


def _try_program(rng: Random, folder: Path) -> str:
    """Return what is lost after a cross-check with a program that does one thing to one kind of answer."""
    when = rng.choice(("hello", "prepare", "step", "observe", "close"))
    act = rng.choice(ACTS) if rng.random() < 0.5 else f"answer[{rng.choice(FIELDS)!r}] = {rng.choice(VALUES)}"
    spoilt = f"if do == {when!r}: {act}"
    manifest = write_manifest(folder, spoilt)
    rows = {}
    try:
        with (
            pytest.MonkeyPatch.context() as patch,
            mock.patch.dict(os.environ, {MANIFESTS: ""}),
            limit_time(4.0 * PATIENT_S, busy=1.0),
            LocalPool(2, LIMIT_S, memory_limit_mb=1500) as pool,
        ):
            limit_only(patch, "toy")
            engines = ["pit", str(manifest)]
            results = cross_check([SCENE], engines, dts=[0.1], profiles=["tuned"], timing=False, pool=pool)
            rows = {row.job.engine: row for row in results.rows}
            text = format_records(results)
    except HangError:
        return f"{spoilt}: no end"
    except Exception as error:  # noqa: BLE001 - this is what is looked for
        return f"{spoilt}: {type(error).__name__}: {str(error)[:300]!r}"
    finally:
        list_adapter_points.cache_clear()
    if rows["pit"].status is not Status.RAN:
        return f"{spoilt}: the other row, too: {rows['pit'].reason[:300]!r}"
    if rows["toy"].status is not Status.RAN and not rows["toy"].reason:
        return f"{spoilt}: a row without a reason: {rows['toy'].status.value}"
    for line in text.splitlines():
        json.loads(line, parse_constant=lambda name: (_ for _ in ()).throw(ValueError(name)))
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
