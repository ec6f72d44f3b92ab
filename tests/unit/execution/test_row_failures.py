"""Errors in a row's run, scoring or report affect only that row, and the reason names the place of the error."""

import json
import re
from collections.abc import Callable
from dataclasses import replace
from importlib import import_module
from pathlib import Path
from typing import Any

import pytest
from tests.cases import each, release_after
from tests.in_process_pool import InProcessPool
from tests.scene_builders import disc_at, require_value, staged, wall_at
from tests.unit.execution.conftest import STANDING

import carom
from carom import Scene
from carom.errors import AdapterError
from carom.execution.exception_text import describe_exception
from carom.execution.job import Job, Method, Status
from carom.execution.observation.engine_run import ObserveTask
from carom.execution.pool import Lane
from carom.execution.results import Results, Row
from carom.model.trace import Trace
from carom.studies.cross_check.document import build_report

SOURCE = (
    STANDING
    + """
def helper(what):
    return {}[what]

class World(Standing):
    def advance(self, steps):
        super().advance(steps)
        if self.act == "raises":
            helper("\\x1b[31mred")
        if self.act == "raises-in-numpy":
            np.zeros(2).reshape(5)

    def observe(self):
        told = ((1.0, 0.0), (0.0, 0.0), (-1.0, 0.0), (0.0, 0.0))
        contacts = (Contact(0, -1, 0.1 * self.steps, (1.0, 0.0), None, told),) if self.steps == 3 else ()
        return replace(super().observe(), contacts=contacts)

sound, raises, raises_in_numpy = map(Adapter, ("sound", "raises", "raises-in-numpy"))
"""
)
NAMES = ("sound", "raises", "raises-in-numpy")


def find_line(words: str) -> int:
    """The number of the line of the source that has these words."""
    return 1 + next(k for k, line in enumerate(SOURCE.splitlines()) if words in line)


@pytest.fixture
def scene(install: Callable[[str, dict[str, str]], None]) -> Scene:
    """A disc that flies at a wall, and adapters that tell odd things of it."""
    install(SOURCE, {name: name.replace("-", "_") for name in NAMES})
    return staged("wall", disc_at(0, 0, 1, 0), wall_at(2, 0, -1, 0), duration_s=2.0)


def run_cross_check(scene: Scene, *engines: str, **options: Any) -> Results:
    asked: dict[str, Any] = {"dts": [0.1], "profiles": ["tuned"], "timing": False, "pool": InProcessPool(), **options}
    return carom.cross_check([scene], ("pit", *engines), **asked)


def index_by_engine(results: Results) -> dict[str, Row]:
    return {row.job.engine: row for row in results.rows}


@each("phases", [0, 2])
def test_scoring_error_affects_only_its_own_row(scene: Scene, monkeypatch: pytest.MonkeyPatch, phases: int) -> None:
    """An exception in scoring, with or without phases, is that row's reason, with its file and line."""
    module = import_module("carom.comparator.compare")
    find_range = module.find_range

    def refuse(baseline: Any, observed: Trace, *more: Any) -> Any:
        if observed.method == "sound" and (observed.scene == scene) is not bool(phases):
            raise ZeroDivisionError("of no length")
        return find_range(baseline, observed, *more)

    monkeypatch.setattr(module, "find_range", refuse)
    rows = index_by_engine(run_cross_check(scene, "sound", phases=phases))
    words = r"the engine's result can't be scored: ZeroDivisionError: of no length \(test_row_failures.py, line \d+\)"
    assert re.match(words, rows["sound"].reason)
    assert (rows["sound"].status, rows["sound"].trace) == (Status.FAILED, None)
    assert rows["pit"].score is not None


@pytest.mark.usefixtures("blank_pages")
@each("fields", release_after(1, [{"settings": {"k": object()}}, {"dt_s": "0.1"}, {"end_time_s": float("nan")}]))
def test_reporting_error_affects_only_its_own_row(scene: Scene, tmp_path: Path, fields: dict[str, Any]) -> None:
    """A row whose record or replay can't be built is a failed row of the report, and the report is written."""
    results = run_cross_check(scene, "sound")
    pit, sound = results.rows
    altered = replace(sound, trace=replace(require_value(sound.trace), **fields))
    results = replace(results, rows=(pit, altered))
    report = build_report(results)
    rows = index_by_engine(report.results)
    assert rows["sound"].status is Status.FAILED
    assert "can't be reported: " in rows["sound"].reason
    assert rows["pit"] == pit
    report.write(tmp_path / "report")
    lines = [json.loads(line) for line in (tmp_path / "report" / "results.jsonl").read_text().splitlines()]
    assert {line["engine"]: line["status"] for line in lines[1:]} == {"pit": "ran", "sound": "failed"}


@each(
    "act, words",
    [
        ("raises", rf"KeyError: '.*red' \(hostile_\w+.py, line {find_line('{}[what]')}\)"),
        ("raises-in-numpy", rf"ValueError: cannot reshape .* \(hostile_\w+.py, line {find_line('reshape')}\)"),
    ],
)
@pytest.mark.usefixtures("in_process")
def test_adapter_exception_is_reported_with_file_and_line(scene: Scene, act: str, words: str) -> None:
    """The reason has the adapter's file and line, even below a library, and escaped control characters."""
    reason = index_by_engine(run_cross_check(scene, act))[act].reason
    assert re.fullmatch(words, reason), reason
    assert "\x1b" not in reason
    with pytest.raises(AdapterError, match=words) as caught:
        carom.run(scene, act, dt=0.1)
    assert "\x1b" not in str(caught.value)


def test_exception_name_and_message_are_escaped() -> None:
    """Control characters in the name and in the message of an exception are replaced by escapes."""
    error = type("Odd\x1b[2JError", (Exception,), {})("with\x07 a bell")
    assert describe_exception(error) == "Odd\\u001b[2JError: with\\u0007 a bell"


SAYING = """
import ctypes, sys
from carom.engines.api import Capabilities, Engine, Profile

ACTS = {
    1.0: "print('a contact too many\\\\n  ')",
    0.5: "print('overflow', file=sys.stderr)",
    0.25: "ctypes.CDLL(None).puts(b'told from C')",
    0.125: "sys.stderr.close()",
}

class Adapter:
    name, engine, capabilities = "says", Engine("Says"), Capabilities()
    profiles = {"tuned": Profile("as it comes", lambda dt: {"dt_s": dt})}

    def prepare(self, scene, settings):
        exec(ACTS.get(settings["dt_s"], ""))
        raise RuntimeError("boom")

adapter = Adapter()
"""


def test_failure_reports_the_last_output_of_its_task(install: Callable[[str, dict[str, str]], None]) -> None:
    """Each failed task in a batch reports its own last line of output, from Python or C, if it printed one."""
    install(SAYING, {"says": "adapter"})
    scene = staged("still", disc_at(0, 0, r=1), duration_s=1)
    steps = (1.0, 0.5, 2.0, 0.25, 0.125, 1.0)
    with Lane(60.0) as lane:
        answers = list(lane.run_each([ObserveTask(Job(scene, Method("says", "tuned"), dt_s)) for dt_s in steps]))
    assert {answer.status for answer in answers} == {Status.FAILED}
    line = 1 + SAYING.split("\n").index('        raise RuntimeError("boom")')
    (said,) = {re.sub(r"\(\S+\.py", "(", answer.reason.partition(";")[0]) for answer in answers}
    assert said == f"RuntimeError: boom (, line {line})"
    boom = answers[0].reason.partition(";")[0]
    printed = ("a contact too many", "overflow", "", "told from C", "", "a contact too many")
    assert [answer.reason for answer in answers] == [
        f"{boom}; it last printed: {words}" if words else boom for words in printed
    ]
