"""An engine that is a program: all its output becomes an answer or an error message."""

import json
import math
import sys
from pathlib import Path

import numpy as np
import pytest
from tests.cases import each
from tests.processes import PATIENT_S
from tests.unit.engines.protocol.programs import (
    LANGUAGES,
    TEMPLATES,
    build_crowd,
    build_still_scene,
    build_template,
    write_manifest,
)

from carom.engines.api import AdapterError, CuttableWorld
from carom.engines.protocol import process
from carom.engines.protocol.adapter import ProgramWorld, program_adapter
from carom.engines.protocol.messages import build_protocol_schema
from carom.engines.registry import load_adapter
from carom.execution.observation.engine_run import observe_run
from carom.execution.timing import time_run

SESSION = Path(__file__).parent / "session.jsonl"
#: What a message ends with whose mistake is in an answer.
REQUESTS = "see docs/reference/engine-protocol.md#the-requests"


@pytest.fixture(autouse=True)
def _patience(monkeypatch: pytest.MonkeyPatch) -> None:
    """Wait for the end of a program however slow the machine is: only then is it known how it ended."""
    monkeypatch.setattr(process, "GRACE_S", PATIENT_S)


def prepare_world(folder: Path, instead: str = "") -> ProgramWorld:
    """Return a world of the honest program, except for a change."""
    return program_adapter(write_manifest(folder, instead)).prepare(build_still_scene(), {"dt_s": 0.5})


def test_program_answers_every_request(tmp_path: Path) -> None:
    """A program's world steps, is observed, cut, saved and restored, and reports the seconds that it measured."""
    world = prepare_world(tmp_path)
    assert isinstance(world, CuttableWorld)
    assert world.settings == {"dt_s": 0.5}
    world.advance(3)
    world.advance(1)
    assert world.seconds == 0.5
    seen = world.observe()
    assert seen.position_m.tolist() == [[0.0, 0.0]]
    assert seen.contacts == ()
    assert world.touching() == {(0, -1)}
    world.cut(0.125)
    world.restore(world.save())
    world.close()


@each(
    "instead, told",
    [
        ("if do == 'step': answer = {'error': {'kind': 'refused', 'message': 'too fast'}}", "refused 'step': too fast"),
        (
            "if do == 'step': sys.stderr.write('inertia is 0\\n'); answer = {'error': {'message': 'boom'}}",
            "failed 'step': boom; it last printed 'inertia is 0'",
        ),
        ("if do == 'step': answer = {}", f"seconds is required, but missing; it wrote b'{{}}'; {REQUESTS}"),
        ("if do == 'step': answer = {'seconds': -1}", "seconds must be greater than or equal to 0, got -1"),
        (
            "if do == 'step': print('{\"seconds\": 1, \"seconds\": 2}', flush=True)",
            "the line is ambiguous: one object has the key 'seconds' twice; it wrote b'{\"seconds\": 1, \"seco",
        ),
        ("if do == 'step': answer = []", "the line must be an object, got []"),
        (
            "if do == 'step': print('debug', flush=True)",
            f"is not JSON; standard output must contain only answers; it wrote b'debug'; {REQUESTS}",
        ),
        (
            "if do == 'step': sys.stderr.write('out of ideas\\n'); sys.exit(3)",
            "exit code 3, it last printed 'out of ideas',",
        ),
        ("if do == 'step': import os, signal; os.kill(os.getpid(), signal.SIGKILL)", "signal 9"),
        ("if do == 'step': sys.stdout.close(); sys.exit()", "closed its output"),
    ],
)
def test_program_error_names_the_engine_and_the_cause(instead: str, told: str, tmp_path: Path) -> None:
    """A refusal, an answer of the wrong form and an exit each raise an AdapterError with engine and cause."""
    world = prepare_world(tmp_path, instead)
    with pytest.raises(AdapterError) as caught:
        world.advance(1)
    assert told in str(caught.value)
    assert "toy" in str(caught.value)
    world.close()


@each(
    "instead, told",
    [
        ("while do == 'step': sys.stdout.write('x' * 65536)", "answered with a line of more than 1 MiB"),
        ("if do == 'step': import os, time; os.close(1); time.sleep(3600)", "closed its output"),
    ],
)
def test_killed_program_is_reported_with_the_reason_for_the_kill(
    instead: str, told: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """If Carom kills a program, the error names the reason for it and not the signal."""
    monkeypatch.setattr(process, "MOST_ANSWER_BYTES", 2**20)
    monkeypatch.setattr(process, "GRACE_S", 0.02)  # neither ends by itself
    with pytest.raises(AdapterError, match=told) as caught:
        prepare_world(tmp_path, instead).advance(1)
    assert "signal" not in str(caught.value)


@each("value", [math.inf, -math.inf, math.nan])
def test_setting_that_json_cannot_express_is_refused(value: float, tmp_path: Path) -> None:
    """Infinity and NaN are refused with the setting's name before the program is called."""
    path = write_manifest(tmp_path)
    path.write_text(path.read_text() + "[profiles.default.settings]\nslop = 0.1\n")
    adapter = program_adapter(path)
    with pytest.raises(AdapterError, match=r"slop must be (finite, as JSON requires|a number), got"):
        adapter.prepare(build_still_scene(), {"dt_s": 0.5, "slop": value})


def test_exited_program_is_restarted_for_the_next_world(tmp_path: Path) -> None:
    """A world of an exited program raises at each request, and the next world has a new program."""
    adapter = program_adapter(write_manifest(tmp_path, "if do == 'step': sys.exit(3)"))
    for _ in range(2):
        world = adapter.prepare(build_still_scene(), {"dt_s": 0.5})
        for told in ("exit code 3", "has ended"):
            with pytest.raises(AdapterError, match=told):
                world.advance(1)


def test_other_protocol_version_and_missing_program_are_refused(tmp_path: Path) -> None:
    """A program of another protocol version, and a command that can't be started, raise an AdapterError."""
    with pytest.raises(AdapterError, match="version 2 of the protocol"):
        prepare_world(tmp_path, "answer['protocol'] = 2")
    with pytest.raises(AdapterError, match="can't be started"):
        program_adapter(write_manifest(tmp_path, command=["./none"])).prepare(build_still_scene(), {"dt_s": 0.5})


def test_file_without_dot_slash_in_a_command_is_reported(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """If a command lacks the ./ of a file next to the manifest, the error shows the correct spelling."""
    path = write_manifest(tmp_path, command=[sys.executable, "program.py"])
    (tmp_path / "empty").mkdir()
    monkeypatch.chdir(tmp_path / "empty")
    with pytest.raises(
        AdapterError, match=r"open file .*program\.py.*; write \./program\.py for the file next to"
    ) as caught:
        program_adapter(path).prepare(build_still_scene(), {"dt_s": 0.5})
    assert str(tmp_path / "empty") not in str(caught.value)  # a worker's folder, another one each time


def test_large_standard_error_does_not_block_a_program(tmp_path: Path) -> None:
    """A program that prints 4 MB on standard error still answers its requests."""
    world = prepare_world(tmp_path, "sys.stderr.write('chatter ' * 500_000)")
    world.advance(1)
    world.close()


@each("language", LANGUAGES)
def test_templates_reproduce_pit(language: str, tmp_path: Path) -> None:
    """Each template, built as its manifest describes, finds the impacts of PIT and its final state within 1e-12."""
    adapter = program_adapter(build_template(language, tmp_path) / "engine.toml")
    assert not adapter.unavailable()
    scene = build_crowd(1.0)
    found, pit = (observe_run(method, scene, "default", 1 / 60) for method in (adapter, load_adapter("pit")))
    assert len(pit.impacts) > 3
    for field in ("first", "second"):
        assert found.impacts[field].tolist() == pit.impacts[field].tolist()
    np.testing.assert_allclose(found.final_position_m, pit.final_position_m, rtol=0, atol=1e-12)
    np.testing.assert_allclose(found.final_velocity_m_s, pit.final_velocity_m_s, rtol=0, atol=1e-12)


def test_published_schema_matches_the_messages() -> None:
    """docs/reference/engine-protocol.schema.json equals the schema generated from the message classes."""
    published = json.loads((TEMPLATES.parent / "reference" / "engine-protocol.schema.json").read_text(encoding="utf-8"))
    assert published == build_protocol_schema()


def test_program_is_timed_by_its_own_clock(tmp_path: Path) -> None:
    """A timing uses the 0.25 s that the program measured, and not the time that the pipes take."""
    adapter = program_adapter(write_manifest(tmp_path))
    assert time_run(adapter, build_still_scene(), "tuned", 0.5, runs=1).advance_s == 0.25


def test_recorded_session_of_version_1_is_replayed(tmp_path: Path) -> None:
    """Today's requests equal those of a recorded session, and its answers give the impacts and end of PIT."""
    player = (
        "import json, sys\n"
        f"with open({str(SESSION)!r}) as session:\n"
        "    for request, answer in map(json.loads, session):\n"
        "        asked = json.loads(sys.stdin.readline())\n"
        "        if asked != request: sys.exit(f'asked {asked}, and recorded is {request}')\n"
        "        print(json.dumps(answer), flush=True)\n"
        "sys.stdin.readline()\n"
    )
    path = write_manifest(tmp_path)
    (tmp_path / "program.py").write_text(player, encoding="utf-8")
    text = (TEMPLATES / "javascript" / "engine.toml").read_text(encoding="utf-8")
    path.write_text(text.replace('["node", "./engine.mjs"]', json.dumps([sys.executable, "./program.py"])))
    trace = observe_run(program_adapter(path), build_crowd(0.0), "default", 1 / 8)
    pit = observe_run(load_adapter("pit"), build_crowd(0.0), "default", 1 / 8)
    assert trace.impacts["second"].tolist() == pit.impacts["second"].tolist()
    np.testing.assert_allclose(trace.final_position_m, pit.final_position_m, rtol=0, atol=1e-13)
