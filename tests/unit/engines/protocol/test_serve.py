"""`carom serve`: an adapter in Python, behind the protocol, gives the digits that it gives without it."""

import json
import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest
from tests.cases import each, long_until
from tests.installed_adapters import write_distribution
from tests.processes import run_command
from tests.scene_builders import Named
from tests.unit.engines.protocol.programs import build_crowd

from carom.engines.protocol.adapter import ProgramAdapter, program_adapter
from carom.engines.protocol.serve import PROFILE, Server, build_manifest
from carom.engines.registry import list_adapter_points, load_adapter
from carom.execution.adapter_profile import capabilities_of
from carom.execution.observation.engine_run import observe_run
from carom.model.trace import Trace

#: Discs that bounce from each other and from a floor.
SCENE = build_crowd(1.0, duration_s=2.0)


def load_served_adapter(folder: Path, name: str) -> ProgramAdapter:
    """Return an adapter behind the protocol."""
    path = folder / "engine.toml"
    command = [sys.executable, "-m", "carom", "serve", name]
    path.write_text(build_manifest(load_adapter(name), f"{name}-served", "1.0", command), encoding="utf-8")
    return program_adapter(path)


def strip_method_details(trace: Trace) -> Trace:
    """Return a run without what it is called, and without counts of the engine's own, which do not travel."""
    ours = {name: count for name, count in trace.counts.items() if name in {"steps", "pieces", "probes"}}
    own = {name: value for name, value in trace.settings.items() if name != PROFILE}
    return replace(trace, method="", settings=own, counts=ours)


@each("name", long_until(1, ["pymunk", "mujoco"]))
def test_served_adapter_gives_bit_identical_runs(name: str, tmp_path: Path, named: Named) -> None:
    """A run through `carom serve` equals the adapter's own run to the bit, including cut steps and settings."""
    adapter, behind = named(name), load_served_adapter(tmp_path, name)
    for profile in (name for name in ("default", "tuned", "located") if name in adapter.profiles):
        here, there = (observe_run(one, SCENE, profile, 1 / 60) for one in (adapter, behind))
        assert len(here.impacts) >= 2
        assert there.settings[PROFILE] == profile
        assert strip_method_details(here) == strip_method_details(there)


def test_served_manifest_has_the_adapters_declarations(tmp_path: Path) -> None:
    """A manifest that `carom serve` writes has all declarations of the adapter, for each of Carom's in Python."""
    ours = [name for name, point in list_adapter_points().items() if point.distribution == "carom"]
    adapters = {name: load_adapter(name) for name in ours if name not in {"pic", "pit"}}
    in_python = {name: one for name, one in adapters.items() if not isinstance(one, ProgramAdapter)}
    assert len(in_python) >= 9
    for name, adapter in in_python.items():
        behind = load_served_adapter(tmp_path, name)
        assert behind.capabilities == adapter.capabilities
        assert dict(behind.knobs) == dict(getattr(adapter, "knobs", {}))
        assert list(behind.profiles) == list(adapter.profiles)
        assert (behind.engine.name, behind.engine.oldest) == (adapter.engine.name, adapter.engine.oldest)
        for key, profile in adapter.profiles.items():
            assert capabilities_of(behind, key) == capabilities_of(adapter, key)
            for field in ("accuracy", "located", "changed"):
                assert getattr(behind.profiles[key], field) == getattr(profile, field)


def format_prepare(profile: str) -> str:
    """Return a request to prepare the scene."""
    settings = {"profile": profile, "dt_s": 0.5}
    return json.dumps({"do": "prepare", "scene": SCENE.model_dump(mode="json"), "settings": settings})


@each(
    "line, kind, told",
    [
        ("", "refused", "the line: Invalid JSON"),
        ("[]", "refused", "the line: "),
        ('{"do": "dance"}', "refused", "the line: Input tag 'dance'"),
        ('{"do": "step", "world": 1}', "refused", "step.steps: Field required"),
        ('{"do": "observe", "world": 5}', "failed", "there is no world 5"),
        (format_prepare("best"), "refused", "pit has no profile 'best'"),
    ],
)
def test_invalid_request_is_answered_with_an_error(line: str, kind: str, told: str) -> None:
    """A line that is not a valid request gets an error, and the server answers the next request."""
    server = Server(load_adapter("pit"), "1.0")
    error = server.answer(line)["error"]
    assert error["kind"] == kind
    assert error["message"].startswith(told)
    assert server.answer('{"do": "hello"}') == {"protocol": 1, "version": "1.0"}


def test_contacts_with_velocities_cannot_be_served() -> None:
    """An observation whose contacts have velocities gets an error, since the protocol has no field for them."""
    server = Server(load_adapter("pit"), "1.0")
    world = server.answer(format_prepare("tuned"))["world"]
    seen = []
    for _ in range(4):  # the scene's duration
        server.answer(json.dumps({"do": "step", "world": world, "steps": 1}))
        seen.append(server.answer(json.dumps({"do": "observe", "world": world})))
    message = "its contacts contain velocities, which the protocol does not support"
    assert {"error": {"kind": "failed", "message": message}} in seen
    assert all("error" in one or one["contacts"] == [] for one in seen)


TALKATIVE = """
print("imported")
from carom.engines.api import Capabilities, Engine, Profile

class Adapter:
    name = "talkative"
    engine = Engine("Talkative", module="talkative", distribution="talkative", oldest="2.0")
    capabilities = Capabilities()
    profiles = {"default": Profile("Talks.", lambda dt_s: {"dt_s": dt_s})}

    def prepare(self, scene, settings):
        print("preparing")
        raise RuntimeError("no")

adapter = Adapter()
"""


def run_talkative_server(site: Path, version: str, *asked: str) -> subprocess.CompletedProcess[str]:
    write_distribution(site, "talkative", {"talkative": "talkative:adapter"}, version=version)
    (site / "talkative.py").write_text(TALKATIVE)
    requests = [{"do": "hello"}, {"do": "prepare", "scene": SCENE.model_dump(mode="json"), "settings": {"dt_s": 1}}]
    return run_command(
        [sys.executable, "-m", "carom", "serve", "talkative", *asked],
        input="".join(json.dumps(one) + "\n" for one in requests),
        check=False,
        env={**os.environ, "PYTHONPATH": os.pathsep.join([str(site), *sys.path])},
    )


def test_engine_output_goes_to_standard_error(tmp_path: Path) -> None:
    """Standard output has only answers, and the engine's output goes to standard error; `--path` is searched first."""
    write_distribution(tmp_path / "other", "talkative", {}, version="3.0")
    done = run_talkative_server(tmp_path, "2.5", "--path", str(tmp_path / "other"))
    answers = [json.loads(line) for line in done.stdout.splitlines()]
    assert answers == [{"protocol": 1, "version": "3.0"}, {"error": {"kind": "failed", "message": "RuntimeError: no"}}]
    assert done.stderr.splitlines() == ["imported", "preparing"]
    assert done.returncode == 0


@pytest.mark.long
def test_too_old_release_is_not_served(tmp_path: Path) -> None:
    """`carom serve` ends with exit code 2 and the reason if the engine's release is too old."""
    done = run_talkative_server(tmp_path, "1.5")
    assert done.returncode == 2
    assert "talkative: Talkative 1.5 is older than 2.0, the oldest release that its adapter supports" in done.stderr
