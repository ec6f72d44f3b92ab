import os
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.attacks.reports import kill_at
from tests.cases import each

from carom.errors import InputError
from carom.support import folders
from carom.support.folders import MARKER, build_file_name, claim, claim_while_writing, write_file, write_files

OLD: dict[str, str | bytes] = {"index.html": "old page", "results.jsonl": b"old rows"}
NEW: dict[str, str | bytes] = {"index.html": "new page", "results.jsonl": b"new rows", "report.md": "new text"}


def read_files(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in folder.iterdir() if path.name != MARKER}


def encode_files(files: dict[str, str | bytes]) -> dict[str, bytes]:
    return {name: text if isinstance(text, bytes) else text.encode() for name, text in files.items()}


def test_folder_with_other_files_is_refused_unchanged(tmp_path: Path) -> None:
    """A folder with files that Carom did not write is refused; the message names a file and the option."""
    (tmp_path / "index.html").write_text("mine")
    with pytest.raises(InputError, match=r"did not write, such as index.html; name another folder by --report"):
        claim(tmp_path, "cross-check", "--report")
    with pytest.raises(InputError, match="did not write"):
        write_files(tmp_path, "cross-check", NEW)
    assert read_files(tmp_path) == {"index.html": b"mine"}
    assert not (tmp_path / MARKER).exists()


@each("torn", ["", "b", "bench", "bench\n", "bench\nCarom replaces the fi"])
def test_incomplete_marker_is_rewritten_in_an_empty_folder(tmp_path: Path, torn: str) -> None:
    """A folder with only an incomplete marker can be used; if it has other files, it is refused."""
    (tmp_path / MARKER).write_text(torn)
    claim(tmp_path, "cross-check")
    assert (tmp_path / MARKER).read_text().startswith("cross-check\n")
    (tmp_path / MARKER).write_text(torn)
    (tmp_path / "index.html").write_text("mine")
    with pytest.raises(InputError, match="another command"):
        claim(tmp_path, "cross-check")


def test_other_files_in_a_folder_of_carom_are_kept(tmp_path: Path) -> None:
    """A command replaces its own files in a folder and keeps all others; it refuses the folder of another command."""
    write_files(tmp_path / "out", "bench", OLD)
    (tmp_path / "out" / "notes.txt").write_text("mine")
    write_files(tmp_path / "out", "bench", NEW)
    with pytest.raises(InputError, match=r"files of another command \(bench instead of cross-check\)"):
        write_files(tmp_path / "out", "cross-check", OLD)
    assert read_files(tmp_path / "out") == {**encode_files(NEW), "notes.txt": b"mine"}


def test_path_that_is_not_a_folder_is_refused_before_the_work(tmp_path: Path) -> None:
    """A file, or a link to a path that can't be created, is refused before anything is run."""
    (tmp_path / "file").write_text("mine")
    (tmp_path / "link").symlink_to(tmp_path / "file" / "else")
    for name in ("file", "link"):
        with pytest.raises(InputError, match="by --out"), claim_while_writing(tmp_path / name, "bench", "--out"):
            pytest.fail("the work began")


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write anywhere")
def test_folder_without_write_permission_is_refused(tmp_path: Path) -> None:
    """A folder that may not be written to is refused before the work."""
    (tmp_path / "out").mkdir(mode=0o500)
    with pytest.raises(InputError, match="ermission"):
        claim(tmp_path / "out", "bench")


def test_work_without_results_leaves_no_folder(tmp_path: Path) -> None:
    """A folder that was created for results is removed if there are none; an existing one is unchanged."""
    with pytest.raises(KeyboardInterrupt), claim_while_writing(tmp_path / "new", "bench"):
        raise KeyboardInterrupt
    assert list(tmp_path.iterdir()) == []
    with claim_while_writing(tmp_path / "new", "bench"), claim_while_writing(tmp_path / "new", "bench"):
        pass
    with claim_while_writing(tmp_path, "bench"):
        pass
    assert list(tmp_path.iterdir()) == []


class _Killed(BaseException):
    """Nothing catches it, as nothing catches a kill."""


def _kill() -> None:
    raise _Killed  # whatever would tidy up is dead as well


def test_kill_leaves_all_old_files_or_all_new_files(tmp_path: Path) -> None:
    """After a kill before any call that changes the disk, a folder has all the old files or all the new ones."""
    found = []
    for number in range(100):
        folder = tmp_path / str(number)
        write_files(folder, "bench", OLD)
        with pytest.MonkeyPatch.context() as monkeypatch:
            kill_at(number, _kill, monkeypatch.setattr)
            try:
                write_files(folder, "bench", NEW)
            except _Killed:
                pass
            else:
                break
        claim(folder, "bench")
        found.append(read_files(folder))
        assert found[-1] in (encode_files(OLD), encode_files(NEW))
    assert number > 12  # three files, two folders, a rename, three moves, and what tidies up
    assert found[0] == encode_files(OLD)
    assert found[-1] == encode_files(NEW)


def test_full_disk_leaves_the_old_files(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """If a file can't be written completely, the old files stay and no partial file remains."""
    write_files(tmp_path / "out", "bench", OLD)
    put = folders._write_synchronised  # noqa: SLF001 - a disk that is full can't be made here

    def full(path: Path, text: str | bytes) -> None:
        put(path, text)
        if path.name == "results.jsonl":
            raise OSError(28, "No space left on device", str(path))

    monkeypatch.setattr(folders, "_write_synchronised", full)
    with pytest.raises(OSError, match="No space"):
        write_files(tmp_path / "out", "bench", NEW)
    assert read_files(tmp_path / "out") == encode_files(OLD)


def test_links_and_pipes_are_written_through(tmp_path: Path) -> None:
    """A link still leads to its file, which is replaced; a new folder is created; a pipe is written to."""
    link, target, pipe = tmp_path / "link.html", tmp_path / "page.html", tmp_path / "pipe"
    target.write_text("old")
    link.symlink_to(target.name)
    write_file(link, "new")
    assert (link.is_symlink(), read_files(tmp_path)) == (True, {"link.html": b"new", "page.html": b"new"})
    write_file(tmp_path / "new" / "page.html", "new")
    assert read_files(tmp_path / "new") == {"page.html": b"new"}
    os.mkfifo(pipe)
    reader = os.open(pipe, os.O_RDONLY | os.O_NONBLOCK)
    write_file(pipe, "new")
    assert (pipe.is_fifo(), os.read(reader, 100)) == (True, b"new")
    os.close(reader)
    with pytest.raises(IsADirectoryError):
        write_file(tmp_path, "new")


NAMES = st.one_of(st.text(min_size=1, max_size=300), st.from_regex(r"[a-cA-C./@-]{1,6}", fullmatch=True))


@given(st.lists(NAMES, min_size=2, max_size=30, unique=True))
def test_different_names_have_different_files(names: list[str]) -> None:
    """File names of different scenes differ even if case and final full stops are ignored."""
    assert len({build_file_name(name).casefold().rstrip(".") for name in names}) == len(names)


@given(NAMES)
def test_file_name_is_safe_on_every_system(name: str) -> None:
    """File names have only a-z, 0-9 and -_.@, begin with a letter or digit, and have at most 100 characters."""
    found = build_file_name(name)
    assert set(found) <= set("abcdefghijklmnopqrstuvwxyz0123456789-_.@")
    assert found[0].isalnum()
    assert len(found) <= 100


def test_unsafe_name_gets_a_digest() -> None:
    """A full stop replaces the slash of an ordinary name; unsafe, empty and unclear names are extended by a digest."""
    assert [build_file_name(name) for name in ("paper/missed", "my-scene_2")] == ["paper.missed", "my-scene_2"]
    unsafe = ["con", "nul/x", "com1", "a-b c", "A", "a.b", "..", "", "-x", "\ud800"]
    assert [name for name in unsafe if "@" not in build_file_name(name)] == []
