from __future__ import annotations

import importlib
import warnings
from pathlib import Path

import pytest
from tests.forms import needs_extension, plain_form

import carom
from carom import extension

PACKAGE = Path(carom.__file__).parent


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
def test_compiled_runs_have_nothing_to_note() -> None:
    """Where the extension serves, there is no note, and however long a wait, no warning."""
    assert extension.extension_notes() == ()
    patience = extension.Patience()
    patience._ends = 0.0  # noqa: SLF001 - long ago
    patience.look()


def test_the_first_long_wait_in_plain_python_is_warned_of_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """A wait of over a second in plain Python warns, once in a process; a shorter one does not."""
    extension._warn.cache_clear()  # noqa: SLF001 - a process that has not warned yet
    with plain_form(), warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        patience = extension.Patience()
        patience.look()
        assert not caught
        monkeypatch.setattr(patience, "_ends", 0.0)
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
