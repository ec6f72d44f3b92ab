from __future__ import annotations

import importlib
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from tests.lengths import each, release_after

import carom
from carom.core import extension

PACKAGE = Path(carom.__file__).parent


def test_every_source_of_the_extension_is_built() -> None:
    """Where `carom.core.built` can be imported, so can the module of each .pyx file of the package."""
    sources = sorted(PACKAGE.rglob("*.pyx"))
    assert sources
    for path in sources:
        name = ".".join(("carom", *path.relative_to(PACKAGE).with_suffix("").parts))
        assert Path(str(importlib.import_module(name).__file__)).suffix != ".py"


def test_a_missing_extension_is_an_error_with_a_remedy(tmp_path: Path) -> None:
    """Importing Carom from a source tree that is not built names the folder and the command, in one error."""
    package = tmp_path / "carom"
    shutil.copytree(PACKAGE, package, ignore=shutil.ignore_patterns("__pycache__", "*.js", "*.html", "*.so", "*.pyd"))
    environment = {**os.environ, "PYTHONPATH": str(tmp_path)}
    command = [sys.executable, "-S", "-c", "import carom"]  # without an editable install, which has modules elsewhere
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 1
    message = done.stderr.splitlines()[-1]
    assert message.startswith(f"ImportError: Carom's compiled extension in {package} cannot be loaded (")
    assert message.endswith("; build it with python setup.py build_ext --inplace, or install the source tree with pip")
    assert done.stderr.count("Traceback") == 1


@each("edited, touched, stale", release_after(1, [(True, True, True), (False, True, False), (False, False, False)]))
def test_an_edited_source_of_an_editable_install_is_warned_of_and_noted(
    edited: bool, touched: bool, stale: bool, tmp_path: Path
) -> None:
    """A change of a header that is not built yet is reported at the first run and in its notes, a new date is not."""
    package = tmp_path / "carom"
    skipped = shutil.ignore_patterns("__pycache__", "*.js", "*.html")
    shutil.copytree(PACKAGE, package, ignore=skipped, copy_function=shutil.copy2)
    source = package / "core/impact_law.h"
    if edited:
        source.write_text(source.read_text() + "/* A comment more. */\n")
    if touched:
        later = Path(package / "core/built.abi3.so").stat().st_mtime + 10.0
        os.utime(source, (later, later))
    code = """
import warnings
with warnings.catch_warnings(record=True) as caught:
    warnings.simplefilter("always")
    from carom.core import extension
    notes = extension.find_extension_notes()
print(extension.__file__, [w.category.__name__ for w in caught], notes)
"""
    environment = {**os.environ, "PYTHONPATH": str(tmp_path)}
    done = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=True)
    assert str(package) in done.stdout
    said = "build it again with python setup.py build_ext --inplace --force" in done.stdout
    assert (said, "StaleExtensionWarning" in done.stdout) == (stale, stale)
    assert said or "[] ()" in done.stdout


def test_the_digest_sees_every_change_of_a_source(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A changed character, a renamed file and a file more each change the digest; the line ends of Windows do not."""
    monkeypatch.setattr(extension, "__file__", str(tmp_path / "core" / "extension.py"))
    (tmp_path / "a.pxd").write_bytes(b"x\ny\n")
    digests = [extension.compute_sources_digest()]
    (tmp_path / "a.pxd").write_bytes(b"x\r\ny\r\n")
    assert extension.compute_sources_digest() == digests[0]
    (tmp_path / "a.pxd").write_bytes(b"x\nz\n")
    digests.append(extension.compute_sources_digest())
    (tmp_path / "a.pxd").rename(tmp_path / "b.pxd")
    digests.append(extension.compute_sources_digest())
    for name in ("c.pyx", "d.h", "e.c"):
        (tmp_path / name).write_bytes(b"")
        digests.append(extension.compute_sources_digest())
    assert len(set(digests)) == len(digests)
