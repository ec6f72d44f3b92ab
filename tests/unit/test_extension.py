from __future__ import annotations

import importlib
import os
import shutil
import subprocess
import sys
import warnings
from pathlib import Path

import pytest
from tests.clocks import Clock
from tests.forms import needs_extension, plain_form
from tests.lengths import long_after

import carom
from carom import extension

PACKAGE = Path(carom.__file__).parent


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> Clock:
    """The clock of `Patience`."""
    clock = Clock()
    monkeypatch.setattr(extension, "time", clock)
    return clock


@needs_extension
def test_every_source_of_the_extension_is_built() -> None:
    """Where `carom.built` can be imported, so can the module of each .pyx file of the package."""
    sources = sorted(PACKAGE.rglob("*.pyx"))
    assert sources
    for path in sources:
        name = ".".join(("carom", *path.relative_to(PACKAGE).with_suffix("").parts))
        assert Path(str(importlib.import_module(name).__file__)).suffix != ".py"


def test_the_plain_form_can_be_asked_for_and_says_so() -> None:
    """With the variable set, plain Python serves, and the note names the variable; afterwards all is as before."""
    before = extension.extension_available()
    with plain_form():
        assert not extension.extension_available()
        (note,) = extension.extension_notes()
        assert extension.PLAIN_VARIABLE in note
    assert extension.extension_available() == before


@needs_extension
def test_compiled_runs_have_nothing_to_note(clock: Clock) -> None:
    """Where the extension serves, there is no note, and however long a wait, no warning."""
    assert extension.extension_notes() == ()
    patience = extension.Patience()
    clock.now_s += 3600.0
    patience.look()


@needs_extension
@pytest.mark.parametrize(
    ("edited", "touched", "stale"), long_after(2, [(True, True, True), (False, True, False), (False, False, False)])
)
def test_an_edited_source_of_an_editable_install_is_warned_of_and_noted(
    edited: bool, touched: bool, stale: bool, tmp_path: Path
) -> None:
    """A change of a .pxd that nobody has built is said at the first run and in its notes; a new date alone is none."""
    package = tmp_path / "carom"
    skipped = shutil.ignore_patterns("__pycache__", "*.js", "*.html")
    shutil.copytree(PACKAGE, package, ignore=skipped, copy_function=shutil.copy2)
    source = package / "solvers/impact/law.pxd"
    if edited:
        source.write_text(source.read_text() + "# A comment more.\n")
    if touched:
        later = Path(package / "built.abi3.so").stat().st_mtime + 10.0
        os.utime(source, (later, later))
    code = """
import warnings
with warnings.catch_warnings(record=True) as caught:
    warnings.simplefilter("always")
    from carom import extension
    notes = extension.extension_notes()
print(extension.__file__, [w.category.__name__ for w in caught], notes)
"""
    environment = {**os.environ, "PYTHONPATH": str(tmp_path)}
    done = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=True)
    assert str(package) in done.stdout
    said = "build it again with python setup.py build_ext --inplace --force" in done.stdout
    assert (said, "StaleExtensionWarning" in done.stdout) == (stale, stale)
    assert said or "[] ()" in done.stdout


def test_the_first_long_wait_in_plain_python_is_warned_of_once(clock: Clock) -> None:
    """A wait of over a second in plain Python warns, once in a process; a shorter one does not."""
    extension._warn.cache_clear()  # noqa: SLF001 - a process that has not warned yet
    with plain_form(), warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        patience = extension.Patience()
        clock.now_s += 1.0
        patience.look()
        assert not caught
        clock.now_s += 0.25
        patience.look()
        patience.look()
    assert [warning.category for warning in caught] == [extension.PlainFormWarning]
    extension._warn.cache_clear()  # noqa: SLF001 - see above


def test_the_digest_sees_every_change_of_a_source(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A changed character, a renamed file and a file more each change the digest; the line ends of Windows do not."""
    monkeypatch.setattr(extension, "__file__", str(tmp_path / "extension.py"))
    (tmp_path / "a.pxd").write_bytes(b"x\ny\n")
    digests = [extension.sources_digest()]
    (tmp_path / "a.pxd").write_bytes(b"x\r\ny\r\n")
    assert extension.sources_digest() == digests[0]
    (tmp_path / "a.pxd").write_bytes(b"x\nz\n")
    digests.append(extension.sources_digest())
    (tmp_path / "a.pxd").rename(tmp_path / "b.pxd")
    digests.append(extension.sources_digest())
    (tmp_path / "c.pyx").write_bytes(b"")
    digests.append(extension.sources_digest())
    assert len(set(digests)) == len(digests)
