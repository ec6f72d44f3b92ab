"""From an engine to its releases as engines of one run: a manifest a release, with today's adapter."""

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
from carom.engines.protocol.serve import served_manifest
from carom.engines.registry import MANIFESTS, adapter_points, distribution_of, load_adapter, resolve_engine, version_of
from carom.execution.job import AdapterTask


@dataclass(frozen=True)
class Origin:
    """Where the releases of an engine come from.

    Attributes:
        engine: What people call the engine.
        registry: Whose client serves it, "pip" or "npm"; empty where none does.
        package: Its name there.
        oldest: Oldest release that its adapter drives; empty where none is known to fail.
        newest_tried: Newest release that the adapter was run on; empty where nobody has noted it.
        manifest: The manifest of one that is a program; empty for an adapter in Python.
        installed: The release that is installed here; empty where none is.
    """

    engine: str
    registry: str
    package: str
    oldest: str
    newest_tried: str
    manifest: str
    installed: str


@dataclass(frozen=True)
class AskOrigin(AdapterTask):
    """Ask an adapter where its engine comes from; the engine is not imported."""

    def carry_out(self) -> Origin:
        """Return what it says."""
        adapter = load_adapter(self.engine)
        known, version = adapter.engine, version_of(adapter, distribution_of(self.engine))
        registry, package, manifest = "pip" if known.distribution else "", known.distribution, ""
        if isinstance(adapter, ProgramAdapter):
            manifest = str(adapter.folder / MANIFEST)
            if "node_modules" in (parts := PurePosixPath(adapter.manifest.package).parts):
                registry, package = "npm", "/".join(parts[parts.index("node_modules") + 1 : -1])
        installed = "" if version == "unknown" else version
        return Origin(known.name, registry, package, known.oldest, known.newest_tried, manifest, installed)


@dataclass(frozen=True)
class AskServed(AdapterTask):
    """Ask for the manifest, as TOML, of an adapter in Python that is served next to a release of its engine."""

    name: str
    version: str
    folder: str

    def carry_out(self) -> str:
        """Return it."""
        command = [sys.executable, "-m", "carom", "serve", self.engine, "--path", self.folder]
        return served_manifest(load_adapter(self.engine), self.name, self.version, command)


def column_name(engine: str, version: str) -> str:
    """Return what a release is called among the engines of a run."""
    return f"{engine}-{re.sub('[^A-Za-z0-9_.-]', '_', version)}"


def laid(manifest: Path, name: str, version: str, overlay: Path, folder: Path) -> Path:
    """Copy the program of an engine from npm next to a release of the engine; return its manifest there.

    The manifest's folder and the files next to it are copied, because node resolves a module from its real path.
    """
    here, there = manifest.parent, folder / manifest.parent.name
    shutil.copytree(here, there, ignore=shutil.ignore_patterns("node_modules"))
    for file in here.parent.iterdir():
        if file.is_file() and file.suffix in {".mjs", ".js", ".cjs"}:
            shutil.copy(file, folder)
    (folder / "package.json").write_text('{"private": true, "type": "module"}\n', encoding="utf-8")
    (folder / "node_modules").symlink_to(overlay / "node_modules", target_is_directory=True)
    told = tomllib.loads(manifest.read_text(encoding="utf-8")) | {"name": name, "version": version}
    (there / MANIFEST).write_text(tomli_w.dumps(told), encoding="utf-8")
    return there / MANIFEST


@contextmanager
def known_columns(manifests: list[Path]) -> Iterator[list[str]]:
    """Have manifests known as engines, and yield their names; afterwards they are not."""
    before = os.environ.get(MANIFESTS)
    try:
        yield [resolve_engine(str(path)) for path in manifests]
    finally:
        if before is None:
            os.environ.pop(MANIFESTS, None)
        else:
            os.environ[MANIFESTS] = before
        adapter_points.cache_clear()
