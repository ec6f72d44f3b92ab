"""What comes over a pipe or out of a journal is of the declared type, or a validation error: never another one."""

import json
from collections.abc import Iterator
from itertools import chain
from pathlib import Path
from typing import Any

import pytest
from pydantic import ValidationError
from tests.cases import each

from carom import solve_pit
from carom.catalogue import all_scenes
from carom.engines.registry import load_adapter
from carom.errors import InputError
from carom.execution.cache_key import JobKey, build_job_key
from carom.execution.codec import CarriedTrace, Codec
from carom.execution.job import Answer, Job, Method, Status
from carom.execution.journal import Journal, JournalEntry
from carom.execution.observation.engine_run import ObserveTask, observe_run
from carom.execution.workers.worker_main import build_codec
from carom.model.trace import Trace
from carom.studies.cross_check.options import Options
from carom.studies.cross_check.run import observed_journal

SCENE = all_scenes()["paper/missed"].scene

#: What JSON can hold in the place of anything else.
WRONG: tuple[Any, ...] = (
    None, 5, -1, 0.5, True, "", "x", [], {}, [1, 2], [[], ""], [[1], None], ["ab", "cd"], [[10**400], ""],
    [[float("inf")], ""], [[2, 2], "AAAA"], [[-1], "AAAA"], 10**400, float("inf"), {"a": {}}, [[[1]], ""],
)  # fmt: skip


def alter_value(value: Any) -> Iterator[Any]:
    """Yield copies of a value of JSON with one thing in it replaced, or taken away."""
    yield from WRONG
    items: Any = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for key, held in items:
        for other in alter_value(held):
            copy = value.copy()
            copy[key] = other
            yield copy
        if isinstance(value, dict):
            yield {name: one for name, one in value.items() if name != key}


@each("name", ["contact/struck", "tables/box-of-edges"])
def test_trace_keeps_every_bit_through_the_codec(name: str) -> None:
    """A trace with contact modes, states, spins and wall edges equals its encoded and decoded copy."""
    codec = Codec[Trace](CarriedTrace)
    trace = observe_run(load_adapter("pic"), all_scenes()[name].scene, "tuned", 1 / 60)
    assert codec.loads(codec.dumps(trace)) == trace


def test_traces_of_one_scene_share_it() -> None:
    """Two decoded traces of one scene have the same scene object, so the scene is validated once."""
    codec = Codec[Trace](CarriedTrace)
    lines = [codec.dumps(solve_pit(SCENE, frame_rate_hz=rate)) for rate in (60, 120)]
    first, second = map(codec.loads, lines)
    assert first.scene == SCENE
    assert first.scene is second.scene


@pytest.fixture
def answer() -> tuple[Codec[Any], list[Any]]:
    """The codec of a worker's answers, and PIT's answer as JSON."""
    codec = build_codec(ObserveTask)
    return codec, json.loads(codec.dumps((0, Answer(Status.RAN, value=solve_pit(SCENE, frame_rate_hz=60)))))


def test_altered_answer_is_a_value_or_a_validation_error(answer: tuple[Codec[Any], list[Any]]) -> None:
    """Decoding an answer with one part replaced or removed returns a value or raises a ValidationError."""
    codec, sound = answer
    trace = json.loads(sound[1]["value"])
    scenes = ({**trace, "scene": json.dumps(one)} for one in alter_value(json.loads(trace["scene"])))
    traces = chain(alter_value(trace), scenes)
    lines = [*alter_value(sound), *([0, {**sound[1], "value": json.dumps(one)}] for one in traces)]
    refused = 0
    for line in lines[::4]:
        try:
            codec.loads(json.dumps(line).encode())
        except ValidationError:
            refused += 1
    assert refused > 125  # so that it is seen to be tried


def test_trace_without_a_required_array_is_refused(answer: tuple[Codec[Any], list[Any]]) -> None:
    """Decoding a trace without final positions raises a ValidationError that names the field."""
    codec, sound = answer
    trace = json.loads(sound[1]["value"]) | {"final_position_m": None}
    with pytest.raises(ValidationError, match="final_position_m"):
        codec.loads(json.dumps([0, {**sound[1], "value": json.dumps(trace)}]).encode())


@pytest.fixture
def journal_lines(tmp_path: Path) -> tuple[Path, list[Any]]:
    """A journal of one run, and what its two lines hold."""
    path, job = tmp_path / "journal.jsonl", Job(SCENE, Method("pit", "tuned"), 1 / 60)
    entry = JournalEntry(build_job_key(job), Answer(Status.RAN, value=solve_pit(SCENE, frame_rate_hz=60)))
    with observed_journal(path, Options().stamp) as journal:
        journal.add([entry])
    return path, [json.loads(line) for line in path.read_text().splitlines()]


def reopen_journal(path: Path, lines: list[Any]) -> Journal[JobKey, Trace]:
    path.write_text("".join(f"{json.dumps(line)}\n" for line in lines))
    return observed_journal(path, Options().stamp, resume=True)


def test_journal_line_with_a_wrong_type_is_refused(journal_lines: tuple[Path, list[Any]]) -> None:
    """A trace's field of the wrong type is refused with the journal's name, the line and the remedy."""
    path, (head, entry) = journal_lines
    trace = json.loads(entry["answer"]["value"])
    for field in trace:
        value = json.dumps(trace | {field: [[1], 5]})
        with pytest.raises(InputError, match=r"journal.jsonl, line 2: .*; remove the line"):
            reopen_journal(path, [head, {**entry, "answer": {**entry["answer"], "value": value}}])


@each("extra", [None, "absent", 5, {}])
def test_journal_header_with_an_unknown_field_is_refused(journal_lines: tuple[Path, list[Any]], extra: Any) -> None:
    """A header with an additional field belongs to another study and is refused, even if the value is null."""
    path, (head, entry) = journal_lines
    with pytest.raises(InputError, match=r"its more is .*, but this study's is absent; name another folder"):
        reopen_journal(path, [head | {"more": extra}, entry])
