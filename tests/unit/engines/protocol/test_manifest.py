"""Manifests: allowed contents, and use of an engine with a manifest like any other engine."""

import os
import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest
from tests.cases import each
from tests.fake_clock import Clock
from tests.in_process_pool import InProcessPool
from tests.processes import read_pid, wait_until_ended
from tests.unit.engines.protocol.programs import build_still_scene, write_manifest

from carom.engines.api import Capabilities, ContactTimes, Stamp
from carom.engines.protocol.manifest import load_manifest
from carom.engines.registry import MANIFESTS, format_engine_argument, list_adapter_points, load_adapter, resolve_engine
from carom.errors import AdapterError
from carom.execution.describe_engines import describe_engines
from carom.execution.job import Job, Method, Status
from carom.execution.observation.engine_run import ObserveTask
from carom.execution.pool import Lane

WHOLE = """
name = "toy"
engine = "Toy engine"
version = "1.2"
command = ["./toy", "--quiet", "../shared.js"]
install = "make toy"
[capabilities]
walls = false
restitution = [0.0, 1.0]
contact_times = "solved"
stamp = "instant"
max_speed_m_s = 400.0
[profiles.default]
description = "As shipped."
settings = { iterations = 4, solver = "pgs", warm = true, slop = 0.005 }
accuracy = { late_steps = 1.0 }
changed = { friction = "the scene's" }
[profiles.tuned]
description = "The best."
located = true
[profiles.tuned.capabilities]
walls = true
"""


def write_manifest_text(folder: Path, text: str) -> Path:
    """Write a manifest."""
    path = folder / "engine.toml"
    path.write_text(text, encoding="utf-8")
    return path


def test_manifest_fields_are_loaded(tmp_path: Path) -> None:
    """Capabilities, accuracy, settings and profiles of a manifest are loaded as typed declarations."""
    found = load_manifest(write_manifest_text(tmp_path, WHOLE))
    assert (found.name, found.engine, found.version) == ("toy", "Toy engine", "1.2")
    able = Capabilities(
        restitution=(0.0, 1.0), contact_times=ContactTimes.SOLVED, stamp=Stamp.INSTANT, max_speed_m_s=400.0, walls=False
    )
    assert found.capabilities == able
    default, tuned = found.profiles["default"], found.profiles["tuned"]
    assert default.settings == {"iterations": 4, "solver": "pgs", "warm": True, "slop": 0.005}
    assert default.accuracy.late_steps == 1.0
    assert (default.changed, tuned.changed) == ({"friction": "the scene's"}, {})
    assert tuned.located
    assert tuned.capabilities == replace(able, walls=True)  # what it leaves out is the engine's


def test_npm_package_decides_availability_and_version(tmp_path: Path) -> None:
    """A missing npm package makes the engine unavailable; an installed one provides its version."""
    whole = WHOLE.replace('version = "1.2"', 'package = "../packages/toys/package.json"')
    whole = whole.replace('"./toy"', f'"{Path(sys.executable).as_posix()}"').replace(
        '"make toy"', '"npm --prefix ../p"'
    )
    found = load_manifest(write_manifest_text(tmp_path, whole))
    assert found.explain_unavailable(tmp_path) == f"toys is not installed; npm --prefix {tmp_path.parent / 'p'}"
    assert found.find_version(tmp_path) == ""
    package = tmp_path.parent / "packages/toys/package.json"
    package.parent.mkdir(parents=True)
    package.write_text('{"name": "toys", "version": "3.4.5"}')
    assert found.explain_unavailable(tmp_path) == ""
    assert found.find_version(tmp_path) == "3.4.5"
    assert "3.4.5 is older than 4.0, the oldest" in found.model_copy(update={"oldest": "4.0"}).explain_unavailable(
        tmp_path
    )
    package.write_text("{")
    assert found.find_version(tmp_path) == ""


@each(
    "old, new, told",
    [
        ('name = "toy"', "", "name: is required"),
        ('version = "1.2"', "version = 1.2", "version: must be a valid string, got 1.2;"),
        ("restitution = [0.0, 1.0]", "restitution = 1", "capabilities.restitution: must be a list, got 1;"),
        ('"instant"', '"middle"', "capabilities: stamp must be one of start, end, instant, got 'middle';"),
        ('name = "toy"', 'name = "toy"\nprotocol = 2', "protocol"),
        ('command = ["./toy", "--quiet", "../shared.js"]', "command = []", "command"),
        ('description = "As shipped."', "", "profiles.default.description"),
        ("slop = 0.005", "slop = [1]", "settings.slop: must be a number, true, false or a text, got [1]"),
        ("slop = 0.005", "slop = inf", "settings.slop: must be finite, as JSON requires, got inf"),
    ],
)
def test_manifest_error_names_the_file_and_the_field(old: str, new: str, told: str, tmp_path: Path) -> None:
    """An invalid manifest is refused with its file, the field or value, and a link to the documentation."""
    path = write_manifest_text(tmp_path, WHOLE.replace(old, new, 1))
    with pytest.raises(AdapterError) as caught:
        load_manifest(path)
    assert str(path) in str(caught.value)
    assert told in str(caught.value)
    assert "see docs/reference/engine-protocol.md#the-manifest" in str(caught.value)


def test_unreadable_manifest_is_refused(tmp_path: Path) -> None:
    """A missing file, a folder, bytes that are not UTF-8, invalid TOML and a file of 2 MiB raise an AdapterError."""
    for data in (None, b"\xff\xfe", b"[capabilities", b"#" * 2**21):
        path = tmp_path / "other.toml"
        if data is not None:
            path.write_bytes(data)
        with pytest.raises(AdapterError, match=r"other\.toml"):
            load_manifest(path)
    with pytest.raises(AdapterError):
        load_manifest(tmp_path)


@pytest.fixture(autouse=True)
def _environment(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    monkeypatch.setenv(MANIFESTS, "")
    list_adapter_points.cache_clear()
    yield
    monkeypatch.undo()
    list_adapter_points.cache_clear()


def test_manifest_path_registers_its_engine(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The path of a manifest or its folder resolves to the engine's name; an installed engine's name stays as it is."""
    path = write_manifest(tmp_path)
    assert resolve_engine("pit") == "pit"
    assert resolve_engine(str(path)) == "toy"
    assert resolve_engine(f"{tmp_path}/") == "toy"
    monkeypatch.chdir(tmp_path)
    assert resolve_engine(".") == "toy"
    assert os.environ[MANIFESTS] == str(path)
    assert (format_engine_argument("toy"), format_engine_argument("pit")) == (str(path), "pit")
    assert load_adapter("toy") is load_adapter("toy")  # so its program is started only once


def test_engine_list_uses_the_manifest_without_starting_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Version and profiles come from the manifest; a missing program or an invalid manifest is a reason."""
    commands = {
        "there": [sys.executable, "-c", "raise SystemExit(1)"],
        "gone": ["./gone"],
        "absent": ["no-program"],
    }
    for name, command in commands.items():
        (tmp_path / name).mkdir()
        write_manifest(tmp_path / name, name=name, command=command, version="3.2", install="make it")
    (tmp_path / "broken.toml").write_text("name = 5")
    known = [str(tmp_path / name) for name in (*commands, "broken.toml")]
    monkeypatch.setenv(MANIFESTS, os.pathsep.join(known))
    infos = {info.name: info for info in describe_engines([*commands, "broken"], InProcessPool())}
    assert (infos["there"].version, infos["there"].unavailable) == ("3.2", "")
    assert sorted(infos["there"].profiles) == ["default", "tuned"]
    assert infos["gone"].unavailable == f"there is no program {tmp_path / 'gone' / 'gone'}; make it"
    assert infos["absent"].unavailable == "no-program is not on the PATH; make it"
    assert f"{tmp_path / 'broken.toml'}: name" in infos["broken"].unavailable


def test_invalid_manifest_path_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A missing manifest, one with the name of an installed engine, and a relative path raise an AdapterError."""
    with pytest.raises(AdapterError, match=r"none\.toml"):
        resolve_engine(str(tmp_path / "none.toml"))
    with pytest.raises(AdapterError, match=r"'pit', but .* already has this name"):
        resolve_engine(str(write_manifest(tmp_path, name="pit")))
    monkeypatch.setenv(MANIFESTS, "here/engine.toml")
    list_adapter_points.cache_clear()
    with pytest.raises(AdapterError, match="absolute"):
        list_adapter_points()


@pytest.mark.long
def test_hanging_program_is_killed_with_its_worker(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A run without an answer in time is reported as timed out, and its program has ended."""
    pid = tmp_path / "pid"
    hangs = f"if do == 'step': import os, time; print(os.getpid(), file=open({str(pid)!r}, 'w')); time.sleep(3600)"
    name = resolve_engine(str(write_manifest(tmp_path, hangs)))
    # No time passes until the program hangs: a busy machine may take long to start it.
    monkeypatch.setattr("carom.execution.workers.worker_process.time", Clock(1.0, starts=pid.exists))
    with Lane(1.0) as lane:
        answer = lane.run(ObserveTask(Job(build_still_scene(), Method(name, "tuned"), 0.5)))
    assert answer.status is Status.TIMED_OUT
    assert wait_until_ended(read_pid(pid))
