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
from carom.engines.protocol.manifest import load_manifest
from carom.engines.protocol.serve import PROFILE, Server, build_manifest
from carom.engines.registry import list_adapter_points, load_adapter
from carom.execution.adapter_profile import capabilities_of
from carom.execution.observation.engine_run import observe_run
from carom.model.trace import Trace

#: Discs that bounce from each other and from a floor.
SCENE = build_crowd(1.0, duration_s=2.0)
#: Those of Carom's adapters whose engine is a Python package.
PYTHON = ("box2d", "dart", "drake", "mujoco", "newton", "ode", "pybullet", "pymunk", "rapier")


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


@each("name", PYTHON)
def test_served_manifest_has_the_adapters_declarations(name: str, tmp_path: Path) -> None:
    """Capabilities, profiles, accuracies, changes, knobs and the oldest release equal those of the adapter."""
    adapter, behind = load_adapter(name), load_served_adapter(tmp_path, name)
    assert behind.capabilities == adapter.capabilities
    assert dict(behind.knobs) == dict(getattr(adapter, "knobs", {}))
    assert list(behind.profiles) == list(adapter.profiles)
    assert (behind.engine.name, behind.engine.oldest) == (adapter.engine.name, adapter.engine.oldest)
    for key, profile in adapter.profiles.items():
        told = behind.profiles[key]
        assert capabilities_of(behind, key) == capabilities_of(adapter, key)
        for name in ("accuracy", "located", "changed"):
            assert getattr(told, name) == getattr(profile, name)


def send_request(server: Server, **request: object) -> dict[str, object]:
    return server.answer(json.dumps(request))


def prepare_scene(server: Server, profile: str) -> dict[str, object]:
    settings = {"profile": profile, "dt_s": 0.5}
    return send_request(server, do="prepare", scene=SCENE.model_dump(mode="json"), settings=settings)


@each(
    "line, kind, told",
    [
        ("", "refused", "the line: Invalid JSON"),
        ("[]", "refused", "the line: "),
        ('{"do": "dance"}', "refused", "the line: Input tag 'dance'"),
        ('{"do": "step", "world": 1}', "refused", "step.steps: Field required"),
        ('{"do": "observe", "world": 5}', "failed", "there is no world 5"),
    ],
)
def test_invalid_request_is_answered_with_an_error(line: str, kind: str, told: str) -> None:
    """A line that is not a valid request gets an error, and the server answers the next request."""
    server = Server(load_adapter("pit"), "1.0")
    error = server.answer(line)["error"]
    assert error["kind"] == kind
    assert error["message"].startswith(told)
    assert send_request(server, do="hello") == {"protocol": 1, "version": "1.0"}


def test_contacts_with_velocities_cannot_be_served() -> None:
    """An observation whose contacts have velocities gets an error, since the protocol has no field for them."""
    server = Server(load_adapter("pit"), "1.0")
    told = prepare_scene(server, "tuned")
    assert "error" not in told
    seen = []
    for _ in range(4):  # the scene's duration
        send_request(server, do="step", world=told["world"], steps=1)
        seen.append(send_request(server, do="observe", world=told["world"]))
    message = "its contacts contain velocities, which the protocol does not support"
    assert {"error": {"kind": "failed", "message": message}} in seen
    assert all("error" in one or one["contacts"] == [] for one in seen)


def test_unknown_profile_is_refused_by_the_server() -> None:
    """A request to prepare a world with an unknown profile is refused with the profile's name."""
    server = Server(load_adapter("pit"), "1.0")
    assert prepare_scene(server, "best") == {"error": {"kind": "refused", "message": "pit has no profile 'best'"}}


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
    """Standard output contains only answers; whatever the engine prints goes to standard error."""
    done = run_talkative_server(tmp_path, "2.5")
    answers = [json.loads(line) for line in done.stdout.splitlines()]
    assert answers == [{"protocol": 1, "version": "2.5"}, {"error": {"kind": "failed", "message": "RuntimeError: no"}}]
    assert done.stderr.splitlines() == ["imported", "preparing"]
    assert done.returncode == 0


@pytest.mark.long
def test_too_old_release_is_not_served(tmp_path: Path) -> None:
    """`carom serve` ends with exit code 2 and the reason, and its manifest makes the engine unavailable."""
    done = run_talkative_server(tmp_path / "site", "1.5")
    assert done.returncode == 2
    reason = "Talkative 1.5 is older than 2.0, the oldest release that its adapter supports"
    assert f"talkative: {reason}" in done.stderr
    shown = run_command(
        [sys.executable, "-m", "carom", "serve", "talkative", "--manifest", "talkative-1.5"],
        env={**os.environ, "PYTHONPATH": os.pathsep.join([str(tmp_path / "site"), *sys.path])},
    )
    path = tmp_path / "engine.toml"
    path.write_text(shown.stdout.removeprefix("imported\n"))
    assert load_manifest(path).explain_unavailable(tmp_path) == reason


@pytest.mark.long
def test_path_option_serves_another_release(tmp_path: Path) -> None:
    """`carom serve --path` searches that folder first and serves the release that it contains."""
    write_distribution(tmp_path / "other", "talkative", {}, version="3.0")
    done = run_talkative_server(tmp_path / "site", "2.5", "--path", str(tmp_path / "other"))
    assert json.loads(done.stdout.splitlines()[0])["version"] == "3.0"


def test_python_list_contains_every_python_adapter() -> None:
    """`PYTHON` lists all of Carom's adapters except PIC, PIT and those that are programs."""
    ours = {name for name, point in list_adapter_points().items() if point.distribution == "carom"}
    own = {"pic", "pit"}
    programs = {name for name in ours - own if isinstance(load_adapter(name), ProgramAdapter)}
    assert sorted(ours - own - programs) == list(PYTHON)
