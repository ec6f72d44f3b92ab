"""The registries' clients get only named requests, end with this process, and run no code of a package."""

import json
import os
import stat
import subprocess
import tarfile
import zipfile
from pathlib import Path

import pytest
from tests.cases import each
from tests.processes import read_pid, wait_until_ended

from carom.errors import InputError
from carom.studies.history import registry_clients
from carom.studies.history.registry_clients import ClientError, Npm, Pip
from carom.studies.history.release_cache import ReleaseCache, open_release_cache


def write_program(folder: Path, name: str, lines: str, patch: pytest.MonkeyPatch) -> None:
    """Put a program of the shell first on the path."""
    path = folder / name
    path.write_text(f"#!/bin/sh\n{lines}\n")
    path.chmod(path.stat().st_mode | stat.S_IXUSR)
    patch.setenv("PATH", str(folder), prepend=os.pathsep)


def test_npm_installs_one_package_without_scripts(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """`npm` is called with `--ignore-scripts` and a package.json with exactly one package and version."""
    made = "mkdir -p node_modules/toy; echo '{}' > node_modules/toy/package.json"
    write_program(tmp_path, "npm", f'echo "$@" > {tmp_path}/asked; {made}', monkeypatch)
    folder = tmp_path / "release"
    folder.mkdir()
    assert Npm().install("toy", "1.2.3", folder) == ("toy@1.2.3",)
    assert "--ignore-scripts" in (tmp_path / "asked").read_text().split()
    assert json.loads((folder / "package.json").read_text())["dependencies"] == {"toy": "1.2.3"}


def test_client_timeout_terminates_its_child_processes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A client that exceeds its time limit is terminated, together with the processes that it started."""
    write_program(tmp_path, "npm", f"sleep 3600 & echo $! > {tmp_path}/child; wait", monkeypatch)

    class Process(subprocess.Popen[bytes]):
        """Reaches its time limit when the program has started a child, not earlier."""

        def wait(self, timeout: float | None = None) -> int:
            if timeout is None:
                return super().wait()
            read_pid(tmp_path / "child")
            raise subprocess.TimeoutExpired(self.args, timeout)

    monkeypatch.setattr(subprocess, "Popen", Process)
    monkeypatch.setattr(registry_clients, "LISTING_S", 0.4)
    with pytest.raises(ClientError, match=r"npm did not finish within 0\.4 s"):
        Npm().list_versions("toy")
    assert wait_until_ended(read_pid(tmp_path / "child"))


@each(
    "lines, told",
    [
        ("echo 'npm error code E404' >&2; exit 1", "npm: npm error code E404"),
        ("echo nonsense", "npm did not print JSON"),
        ("echo 7", "npm lists no versions of toy"),
        ("exit 3", "npm: exit code 3"),
    ],
)
def test_client_error_has_last_output_or_reason(
    lines: str, told: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The error of a client contains its last line of output, its exit code or what is wrong with its answer."""
    write_program(tmp_path, "npm", lines, monkeypatch)
    with pytest.raises(ClientError, match=told):
        Npm().list_versions("toy")


@each("name", ["--global", "-g", "../toy", "a b", "http://x/y.tgz", "", "a;b"])
def test_option_or_address_as_package_or_version_is_refused(name: str, tmp_path: Path) -> None:
    """An option, a path or a URL instead of a package name or a version is refused."""
    for client in (Pip(), Npm()):
        with pytest.raises(ClientError, match="is not a package name"):
            client.list_versions(name)
        with pytest.raises(InputError, match="a version must begin with a digit"):
            client.install("toy", name, tmp_path)


def write_wheel(folder: Path, name: str, version: str, needs: str = "") -> None:
    """Write a wheel with one module."""
    info = f"{name}-{version}.dist-info"
    metadata = f"Metadata-Version: 2.1\nName: {name}\nVersion: {version}\n"
    metadata += f"Requires-Dist: {needs}\n" if needs else ""
    with zipfile.ZipFile(folder / f"{name}-{version}-py3-none-any.whl", "w") as file:
        file.writestr(f"{name}.py", f"VERSION = {version!r}\n")
        file.writestr(f"{info}/METADATA", metadata)
        file.writestr(f"{info}/WHEEL", "Wheel-Version: 1.0\nGenerator: x\nRoot-Is-Purelib: true\nTag: py3-none-any\n")
        file.writestr(f"{info}/RECORD", "")


@pytest.fixture
def wheels(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder that pip takes for its registry."""
    folder = tmp_path / "wheels"
    folder.mkdir()
    monkeypatch.setenv("PIP_NO_INDEX", "1")
    monkeypatch.setenv("PIP_FIND_LINKS", str(folder))
    monkeypatch.setenv("PIP_CONFIG_FILE", os.devnull)
    return folder


@pytest.mark.long
def test_pip_installs_release_with_missing_requirements(wheels: Path, tmp_path: Path) -> None:
    """`pip` installs a release with its missing requirements; numpy, which is installed, is not installed again."""
    write_wheel(wheels, "caromtoy", "1.0", "caromtoyneeds")
    write_wheel(wheels, "caromtoy", "2.0", "numpy")
    write_wheel(wheels, "caromtoyneeds", "5.0")
    assert sorted(Pip().list_versions("caromtoy")) == ["1.0", "2.0"]
    for version, holds in (("1.0", ("caromtoy==1.0", "caromtoyneeds==5.0")), ("2.0", ("caromtoy==2.0",))):
        folder = tmp_path / version
        folder.mkdir()
        assert Pip().install("caromtoy", version, folder) == holds
        assert {path.name for path in folder.glob("*.py")} == {f"{one.partition('==')[0]}.py" for one in holds}


@pytest.mark.long
def test_pip_refuses_source_distributions(wheels: Path, tmp_path: Path) -> None:
    """A release that exists only as a source distribution is refused, and its setup.py does not run."""
    source = tmp_path / "caromtoy-3.0"
    source.mkdir()
    (source / "setup.py").write_text(f"open({str(tmp_path / 'ran')!r}, 'w')\n")
    with tarfile.open(wheels / "caromtoy-3.0.tar.gz", "w:gz") as file:
        file.add(source, "caromtoy-3.0")
    folder = tmp_path / "release"
    folder.mkdir()
    with pytest.raises(ClientError, match="No matching distribution found"):
        Pip().install("caromtoy", "3.0", folder)
    assert not (tmp_path / "ran").exists()


class Breaks:
    """A client that is broken off in the middle."""

    def list_versions(self, package: str) -> tuple[str, ...]:
        raise NotImplementedError(package)

    def install(self, package: str, version: str, folder: Path) -> tuple[str, ...]:
        (folder / "half").write_bytes(b"0" * 1000)
        if version == "2":  # after half of it
            raise KeyboardInterrupt
        return (f"{package}=={version}",)


def test_interrupted_installation_leaves_no_release(tmp_path: Path) -> None:
    """An installation that Ctrl-C interrupts leaves no release and no file."""
    kept = ReleaseCache(tmp_path)
    with pytest.raises(KeyboardInterrupt):
        kept.install(Breaks(), "npm", "@a/toy", "2")
    assert kept.find("npm", "@a/toy", "2") is None
    assert [path.name for path in tmp_path.rglob("*") if path.is_file()] == []


def test_release_cache_keeps_most_recently_used_releases(tmp_path: Path) -> None:
    """Of three releases of 1 kB in a cache of 2.5 kB, the two most recently used ones stay."""
    with open_release_cache(1e9, tmp_path) as kept:
        for age, version in enumerate(("1", "3", "4")):
            os.utime(kept.install(Breaks(), "pip", "toy", version) / "carom-release.json", (age, age))
        assert kept.find("pip", "toy", "1") is not None
    with open_release_cache(2.5e3, tmp_path):
        pass
    assert sorted(ReleaseCache(tmp_path).versions("pip", "toy")) == ["1", "4"]


def test_release_cache_removes_nothing_while_in_use(tmp_path: Path) -> None:
    """The cache removes no release while another user has it open; it removes it after the last use."""
    with open_release_cache(1e9, tmp_path) as kept:
        kept.install(Breaks(), "pip", "toy", "1")
        with open_release_cache(1.0, tmp_path):
            pass
        assert kept.versions("pip", "toy") == ("1",)
    with open_release_cache(1.0, tmp_path):
        pass
    assert ReleaseCache(tmp_path).versions("pip", "toy") == ()


@each("instead", ["a file", "a link", "", "\x00" * 40, "[" * 100_000])
def test_damaged_release_is_installed_again(instead: str, tmp_path: Path) -> None:
    """A release with a damaged list, or a file or a link in its place, is replaced; the link's target stays."""
    kept, other = ReleaseCache(tmp_path / "root"), tmp_path / "other"
    place = kept.install(Breaks(), "pip", "toy", "1")
    other.mkdir()
    if instead in {"a file", "a link"}:
        place.rename(tmp_path / "before")
        place.write_text("") if instead == "a file" else place.symlink_to(other)
    else:
        (place / "carom-release.json").write_text(instead)
        (place / "half").unlink()
    assert kept.find("pip", "toy", "1") is None
    assert kept.install(Breaks(), "pip", "toy", "1") == place
    assert (place / "half").is_file()
    assert not place.is_symlink()
    assert list(other.iterdir()) == []
