"""A worker's folder is removed whatever an engine did to it, and nothing next to it is touched."""

import os
from collections.abc import Callable
from pathlib import Path

import pytest
from tests.cases import each

from carom.execution.workers.working_folder import Folder, _clear_abandoned


def replace_with_link(work: Path, outside: Path) -> None:
    """Put a link where the folder was."""
    work.rmdir()
    work.symlink_to(outside)


def replace_with_dangling_link(work: Path, outside: Path) -> None:
    """Put a link to nothing where the folder was."""
    work.rmdir()
    work.symlink_to(outside / "nothing")


def replace_with_file(work: Path, outside: Path) -> None:
    """Put a file where the folder was."""
    del outside
    work.rmdir()
    work.write_text("a file")


def nest_folders(work: Path, outside: Path) -> None:
    """Make folders in folders, more than Python goes down to and longer in names than the system takes."""
    del outside
    within = os.open(work, os.O_RDONLY)
    for _ in range(1_100):
        os.mkdir("deep", dir_fd=within)
        below = os.open("deep", os.O_RDONLY, dir_fd=within)
        os.close(within)
        within = below
    os.close(within)


def fill_folder(work: Path, outside: Path) -> None:
    """Leave folders of one name in several places, forbidden ones, links, and folders named as numbers."""
    for name in ("a/b/0", "0/1/2", "1/a", "2"):
        (work / name).mkdir(parents=True, exist_ok=True)
        (work / name / "file").write_text("x")
        (work / name / "link").symlink_to(outside)
    (work / "a" / "b").chmod(0)
    (work / "0").chmod(0)


@each("act", [replace_with_link, replace_with_dangling_link, replace_with_file, nest_folders, fill_folder])
def test_folder_is_removed_whatever_an_engine_did_to_it(
    act: Callable[[Path, Path], None], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A folder that was replaced, or filled with deep or forbidden folders, is removed, and no link's target."""
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path / "temp"))
    (tmp_path / "temp").mkdir()
    (tmp_path / "outside").mkdir(mode=0o750)
    (tmp_path / "outside" / "kept").write_text("kept")
    folder = Folder()
    act(folder.path, tmp_path / "outside")
    folder.close()
    assert [*(tmp_path / "temp").iterdir()] == []
    assert (tmp_path / "outside" / "kept").read_text() == "kept"
    assert (tmp_path / "outside").stat().st_mode & 0o777 == 0o750


def test_interrupted_removal_is_finished_at_the_next_start(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """If a process is killed while it removes its folder, the next start removes what is left."""
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    folder = Folder()
    fill_folder(folder.path, tmp_path)
    remove, left = os.rmdir, 4

    class Killed(BaseException):
        pass

    def rmdir(*arguments: object, **options: object) -> None:
        nonlocal left
        left -= 1
        if not left:
            raise Killed
        remove(*arguments, **options)  # type: ignore[arg-type]  # as it was called

    monkeypatch.setattr(os, "rmdir", rmdir)
    with pytest.raises(Killed):
        folder.close()
    monkeypatch.setattr(os, "rmdir", remove)
    os.close(folder._lock)  # noqa: SLF001 - as the system does when a process is killed
    assert [*tmp_path.iterdir()] != []
    _clear_abandoned.__wrapped__()
    assert [*tmp_path.iterdir()] == []
