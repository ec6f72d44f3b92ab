"""Manifests that register each release of an engine as a separate engine. All releases use the installed adapter."""

from __future__ import annotations

import os
import re
import shutil
import sys
import tomllib
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path, PurePosixPath

import tomli_w

from carom.engines.protocol.adapter import ProgramAdapter
from carom.engines.protocol.manifest import MANIFEST
from carom.engines.protocol.serve import build_manifest
from carom.engines.registry import (
    MANIFESTS,
    distribution_of,
    find_version,
    list_adapter_points,
    load_adapter,
    resolve_engine,
)
from carom.execution.job import AdapterTask


@dataclass(frozen=True)
class Origin:
    """The registry and package from which an engine's releases are installed.

    Attributes:
        engine: Display name of the engine.
        registry: Name of the registry's client, "pip" or "npm"; empty without a registry.
        package: Name of the engine's package in the registry.
        oldest: Oldest release that the adapter supports; empty if all known releases are supported.
        newest_tried: Newest release that was tested with the adapter; empty if unknown.
        manifest: Manifest of an engine in another language; empty for an adapter in Python.
        installed: The installed release; empty if none is installed.
    """

    engine: str
    registry: str
    package: str
    oldest: str
    newest_tried: str
    manifest: str
    installed: str


@dataclass(frozen=True)
class OriginTask(AdapterTask):
    """Task that finds the registry and package of an adapter's engine, without importing the engine."""

    def carry_out(self) -> Origin:
        """Return the registry and package."""
        adapter = load_adapter(self.engine)
        known, version = adapter.engine, find_version(adapter, distribution_of(self.engine))
        registry, package, manifest = "pip" if known.distribution else "", known.distribution, ""
        if isinstance(adapter, ProgramAdapter):
            manifest = str(adapter.folder / MANIFEST)
            if "node_modules" in (parts := PurePosixPath(adapter.manifest.package).parts):
                registry, package = "npm", "/".join(parts[parts.index("node_modules") + 1 : -1])
        installed = "" if version == "unknown" else version
        return Origin(known.name, registry, package, known.oldest, known.newest_tried, manifest, installed)


@dataclass(frozen=True)
class ServedManifestTask(AdapterTask):
    """Task that builds a TOML manifest for a release of an engine whose adapter is in Python."""

    name: str
    version: str
    folder: str

    def carry_out(self) -> str:
        """Return the manifest."""
        command = [sys.executable, "-m", "carom", "serve", self.engine, "--path", self.folder]
        return build_manifest(load_adapter(self.engine), self.name, self.version, command)


def release_engine_name(engine: str, version: str) -> str:
    """Return the name under which a release is registered as an engine."""
    return f"{engine}-{re.sub('[^A-Za-z0-9_.-]', '_', version)}"


def copy_program(manifest: Path, name: str, version: str, overlay: Path, folder: Path) -> Path:
    """Copy the program of an npm engine into a folder with a release of the engine. Return the path of the manifest.

    The files are copied and not linked, because Node searches for modules starting from a file's real path.
    """
    source_folder, target_folder = manifest.parent, folder / manifest.parent.name
    shutil.copytree(source_folder, target_folder, ignore=shutil.ignore_patterns("node_modules"))
    for file in source_folder.parent.iterdir():
        if file.is_file() and file.suffix in {".mjs", ".js", ".cjs"}:
            shutil.copy(file, folder)
    (folder / "package.json").write_text('{"private": true, "type": "module"}\n', encoding="utf-8")
    (folder / "node_modules").symlink_to(overlay / "node_modules", target_is_directory=True)
    renamed = tomllib.loads(manifest.read_text(encoding="utf-8")) | {"name": name, "version": version}
    (target_folder / MANIFEST).write_text(tomli_w.dumps(renamed), encoding="utf-8")
    return target_folder / MANIFEST


@contextmanager
def registered_engines(manifests: list[Path]) -> Iterator[None]:
    """Register manifests as engines for the duration of a `with` block."""
    before = os.environ.get(MANIFESTS, "")
    try:
        for path in manifests:
            resolve_engine(str(path))
        yield
    finally:
        os.environ[MANIFESTS] = before
        list_adapter_points.cache_clear()
