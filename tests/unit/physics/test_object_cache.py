"""Object files on disk: found again, never taken for others, and kept somewhere that can be written."""

from __future__ import annotations

import os
import sys
from pathlib import Path

import pytest

from carom.physics import object_cache

NAME = "run_0123456789abcdef"


@pytest.fixture
def source(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    """Return a source file in a tree that can be written, with the user's cache directory elsewhere."""
    monkeypatch.delenv("CAROM_CACHE_DIR", raising=False)
    monkeypatch.setattr(sys, "platform", "linux")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "user"))
    (tmp_path / "tree").mkdir()
    return str(tmp_path / "tree" / "kernel.py")


def test_what_was_written_is_read_again(source: str) -> None:
    """An object file comes back byte for byte, from beside the source."""
    assert object_cache.read(source, NAME, "here") is None
    path = object_cache.write(source, NAME, "here", b"code")
    assert path is not None
    assert path.parent == Path(source).parent / "__pycache__"
    assert object_cache.read(source, NAME, "here") == b"code"
    assert object_cache.holds(source, NAME)


def test_a_file_for_another_key_is_ignored_even_under_the_right_name(source: str) -> None:
    """The file of another machine is never read, even where it has got the name of this machine's."""
    other, own = (object_cache.write(source, NAME, key, b"code") for key in ("other", "own"))
    assert other is not None
    assert own is not None
    other.replace(own)
    assert object_cache.read(source, NAME, "own") is None


def test_every_truncation_is_noticed(source: str) -> None:
    """However short a file was cut, it counts as none."""
    path = object_cache.write(source, NAME, "here", b"code")
    assert path is not None
    content = path.read_bytes()
    for length in range(len(content)):
        path.write_bytes(content[:length])
        assert object_cache.read(source, NAME, "here") is None


def test_a_tree_that_cannot_be_written_leaves_the_users_cache_directory(source: str, tmp_path: Path) -> None:
    """Where there is no writing beside the source, files go to the user's cache directory, and are found there."""
    (tmp_path / "tree" / "__pycache__").write_text("no directory")
    path = object_cache.write(source, NAME, "here", b"code")
    assert path is not None
    assert path.parent == tmp_path / "user" / "carom"
    assert object_cache.read(source, NAME, "here") == b"code"


def test_nowhere_to_write_is_no_error(source: str, tmp_path: Path) -> None:
    """Where nothing can be written, nothing is kept, and nothing left behind."""
    (tmp_path / "tree" / "__pycache__").write_text("no directory")
    (tmp_path / "user").write_text("no directory")
    assert object_cache.write(source, NAME, "here", b"code") is None
    assert object_cache.read(source, NAME, "here") is None
    assert not object_cache.holds(source, NAME)


def test_the_environment_names_another_place(source: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """With CAROM_CACHE_DIR set, files are kept there and nowhere else."""
    monkeypatch.setenv("CAROM_CACHE_DIR", str(tmp_path / "named"))
    path = object_cache.write(source, NAME, "here", b"code")
    assert path is not None
    assert path.parent == tmp_path / "named"
    assert not (tmp_path / "tree" / "__pycache__").exists()


def test_superseded_files_of_a_function_are_cleared_away(source: str) -> None:
    """Of one function the files used last are kept; those of others, of whatever name, stay."""
    object_cache.write(source, "run_again_0123456789abcdef", "here", b"another function")
    names = [f"run_{k:016x}" for k in range(20)]
    for age, name in enumerate(names):
        path = object_cache.write(source, name, "here", b"code")
        assert path is not None
        os.utime(path, (age, age))
        object_cache.read(source, names[0], "here")  # in use all the time
    kept = [name for name in names if object_cache.read(source, name, "here")]
    assert kept[0] == names[0]
    assert len(kept) < 10
    assert kept[1:] == names[-len(kept) + 1 :]
    assert object_cache.read(source, "run_again_0123456789abcdef", "here")
