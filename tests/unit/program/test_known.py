"""An engine that is a program is asked for by its manifest, or known by the environment, and listed like any other."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from tests.command import carom_command, told
from tests.unit.program.programs import manifest_of

import carom
from carom.errors import AdapterError
from carom.registry import MANIFESTS, adapter_points, asked_as, engine_named, load_adapter
from carom.runs.engines import described
from carom.runs.job import Job, Method, Status
from carom.runs.observe import Observe
from carom.runs.pool import InProcess, Lane
from carom.scene import Disc, Scene


@pytest.fixture(autouse=True)
def _environment(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    monkeypatch.setenv(MANIFESTS, "")
    adapter_points.cache_clear()
    yield
    monkeypatch.undo()
    adapter_points.cache_clear()


def test_a_manifest_makes_its_engine_known(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A manifest, or its folder, is its engine's name from then on, for worker processes too; a name stays as it is."""
    path = manifest_of(tmp_path)
    assert engine_named("pit") == "pit"
    assert engine_named(str(path)) == "toy"
    assert engine_named(f"{tmp_path}/") == "toy"
    monkeypatch.chdir(tmp_path)
    assert engine_named(".") == "toy"
    assert os.environ[MANIFESTS] == str(path)
    assert (asked_as("toy"), asked_as("pit")) == (str(path), "pit")


def test_one_program_serves_whoever_loads_its_adapter(tmp_path: Path) -> None:
    """Each run of a worker loads the adapter by its name, and none but the first starts the program."""
    name = engine_named(str(manifest_of(tmp_path)))
    assert load_adapter(name) is load_adapter(name)


def test_listing_reads_the_manifest_and_starts_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The version and the profiles are the manifest's; a program that is missing is a reason, with what installs it."""
    for name, command in (("there", [sys.executable, "-c", "raise SystemExit(1)"]), ("gone", ["./gone"])):
        (tmp_path / name).mkdir()
        manifest_of(tmp_path / name, name=name, command=command, version="3.2", install="make it")
    (tmp_path / "broken.toml").write_text("name = 5")
    known = [str(tmp_path / name) for name in ("there", "gone", "broken.toml")]
    monkeypatch.setenv(MANIFESTS, os.pathsep.join(known))
    infos = {info.name: info for info in described(["there", "gone", "broken"], InProcess())}
    assert (infos["there"].version, infos["there"].unavailable) == ("3.2", "")
    assert sorted(infos["there"].profiles) == ["default", "tuned"]
    assert infos["gone"].unavailable == f"there is no program {tmp_path / 'gone' / 'gone'}; make it"
    assert f"{tmp_path / 'broken.toml'}: name" in infos["broken"].unavailable


def test_what_can_not_be_known_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A manifest that is not there, one with the name of another engine, and a relative path are each a sentence."""
    with pytest.raises(AdapterError, match=r"none\.toml"):
        engine_named(str(tmp_path / "none.toml"))
    with pytest.raises(AdapterError, match="'pit', and so does"):
        engine_named(str(manifest_of(tmp_path, name="pit")))
    monkeypatch.setenv(MANIFESTS, "here/engine.toml")
    adapter_points.cache_clear()
    with pytest.raises(AdapterError, match="absolute"):
        adapter_points()


@pytest.mark.long
def test_a_program_that_is_not_there_is_unavailable_to_the_command_line(tmp_path: Path) -> None:
    """The exit code is that of an engine that is missing, and no crash; what installs it is said."""
    path = manifest_of(tmp_path, command=["./gone"], install="make it")
    result = carom_command("run", "paper/missed", "-e", str(path), "-p", "tuned", "--dt", "1/60")
    assert result.exit_code == 3, result.output
    assert "make it" in told(result)


@pytest.mark.long
def test_a_program_that_hangs_ends_with_its_worker(tmp_path: Path) -> None:
    """A run that gives no answer in time is a row, and its program is gone with the worker that started it."""
    pid = tmp_path / "pid"
    hangs = f"if do == 'step': import os, time; open({str(pid)!r}, 'w').write(str(os.getpid())); time.sleep(3600)"
    name = engine_named(str(manifest_of(tmp_path, hangs)))
    scene = Scene(name="still", discs=[Disc(position_m=(0, 0), radius_m=1)], duration_s=1.0)
    with Lane(20.0) as lane:  # by when the program has been started, on a machine that is busy
        answer = lane.ask(Observe(Job(scene, Method(name, "tuned"), 0.5)))
    assert answer.status is Status.TIMED_OUT
    with pytest.raises(ProcessLookupError):
        os.kill(int(pid.read_text()), 0)


@pytest.mark.long
def test_the_command_line_takes_a_manifest(tmp_path: Path) -> None:
    """`carom run -e engine.toml` runs the program: here one that misses every impact. So does `carom.run`."""
    path = manifest_of(tmp_path)
    arguments = ["-p", "tuned", "--dt", "1/60", "--no-timing"]
    result = carom_command("run", "paper/missed", "-e", str(path), *arguments)
    assert "toy" in result.output
    refused = carom_command("run", "-e", str(tmp_path / "no.toml"))
    assert refused.exit_code == 2
    still = Scene(name="still", discs=[Disc(position_m=(0, 0), radius_m=1)], duration_s=1.0)
    assert carom.run(still, str(path), dt=0.5).method == "toy"
