"""Writes files into output folders. In these folders Carom replaces and removes only its own files.

A marker file in each folder states the folder's purpose. Carom writes only into folders that are new, empty, or marked
for the same purpose.

All files of a result are replaced together. New files are first written into a temporary folder and synchronised to the
disk. Carom then renames the temporary folder, to mark the files as complete, and moves the files to their places. If a
kill or a power cut interrupts the move, the next command completes the move. So users find either all old files or all
new files.
"""

from __future__ import annotations

import hashlib
import os
import re
import shutil
import tempfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

from carom.errors import InputError
from carom.support.escaping import escape_controls

MARKER = ".carom"
#: Second line of a marker. The first line is the folder's purpose, as one word.
_MARKER_TEXT = "Carom replaces the files that it wrote here.\n"
#: A temporary folder has the name `_NEW` while files are written, and `_WHOLE` when all files are complete.
_NEW, _WHOLE = ".carom-new", ".carom-whole"

#: Longest file name without endings. Most systems allow 255 bytes in all.
_LONGEST_NAME = 100
#: Names of devices on Windows. A name followed by a full stop and any text is also reserved.
_DEVICES = re.compile(r"(con|prn|aux|nul|com[0-9]|lpt[0-9])(\.|$)")
_PLAIN = re.compile(r"[a-z0-9][a-z0-9_-]*(/[a-z0-9][a-z0-9_-]*)*")


def build_file_name(name: str) -> str:
    """Return a unique file name, without an ending, for a name such as the name of a scene.

    A name of lower-case letters, digits, ``-``, ``_`` and ``/`` stays the same, except that ``.`` replaces ``/``. Any
    other name is simplified and gets a digest (hash). So no two names have the same file name, even if the file system
    ignores case.
    """
    plain = name.replace("/", ".")
    if _PLAIN.fullmatch(name) and len(name) <= _LONGEST_NAME and not _DEVICES.match(plain):
        return plain
    stem = re.sub("[^a-z0-9]+", "-", name.lower())[: _LONGEST_NAME // 2].strip("-") or "name"
    return f"{stem}@{hashlib.sha256(name.encode(errors='surrogatepass')).hexdigest()[:16]}"


def claim(folder: Path, purpose: str, option: str = "") -> None:
    """Mark a folder as Carom's. If an earlier write into the folder was interrupted, complete the write.

    Args:
        folder: The folder, created if it does not exist.
        purpose: Purpose of the folder, as one word for the marker.
        option: Name of the command-line option for the folder, for error messages.

    Raises:
        InputError: The folder can't be created or written into, contains other files, or has another purpose.
    """
    hint = f"name another folder{option and f' by {option}'}"
    try:
        folder.mkdir(parents=True, exist_ok=True)
        names = os.listdir(folder)
        if not names or (names == [MARKER] and _is_incomplete(folder / MARKER)):
            (folder / MARKER).unlink(missing_ok=True)
            _write_synchronised(folder / MARKER, f"{purpose}\n{_MARKER_TEXT}")
            return
        if not os.access(folder, os.W_OK | os.X_OK):
            raise InputError(f"{folder}: no permission to write there", hints=[hint])
        if MARKER not in names:
            raise InputError(f"{folder} holds files that Carom did not write, such as {min(names)}", hints=[hint])
        with (folder / MARKER).open(encoding="utf-8", errors="replace") as file:
            found = file.readline(100).strip()
    except OSError as error:
        raise InputError(f"{error.filename or folder}: {error.strerror or error}", hints=[hint]) from None
    if found != purpose:
        raise InputError(f"{folder} contains files of another command ({found} instead of {purpose})", hints=[hint])
    _complete_write(folder)


@contextmanager
def claim_while_writing(folder: Path, purpose: str, option: str = "") -> Iterator[None]:
    """Mark a folder like `claim`, and run a block that writes into the folder.

    If nothing was written, remove the marker.
    """
    new, marked = not folder.exists(), (folder / MARKER).exists()
    try:
        claim(folder, purpose, option)
        yield
    finally:
        if not marked and folder.is_dir() and os.access(folder, os.R_OK) and set(os.listdir(folder)) <= {MARKER}:
            (folder / MARKER).unlink(missing_ok=True)  # another process may have removed the marker
            if new:
                folder.rmdir()


def write_files(folder: Path, purpose: str, contents: Mapping[str, str | bytes]) -> Path:
    """Write either all of the files or none into a marked folder. Replace older files.

    Return the path of the first file.

    Raises:
        InputError: The folder can't be used; see `claim`.
        OSError: The files can't be written.
    """
    claim(folder, purpose)
    new = folder / _NEW
    new.mkdir()
    try:
        for name, content in contents.items():
            _write_synchronised(new / name, content)
        _synchronise_folder(new)
        new.rename(folder / _WHOLE)
    except BaseException:
        _remove_unfinished(new)
        raise
    _complete_write(folder)
    return folder / next(iter(contents))


def write_file(path: Path, content: str | bytes) -> Path:
    """Write a file atomically at a path that the user gave. Replace an older file. Return the path.

    The function follows links, and writes directly into a pipe or a device such as ``/dev/stdout``.

    Raises:
        OSError: The file can't be written.
    """
    if path.exists() and not path.is_file():
        path.write_bytes(_encode_content(content))
        return path
    place = path.resolve()
    place.parent.mkdir(parents=True, exist_ok=True)
    part = place.with_name(f".{build_file_name(place.name)}.{os.getpid()}.part")
    try:
        _write_synchronised(part, content)
        part.replace(place)
    finally:
        part.unlink(missing_ok=True)
    _synchronise_folder(place.parent)
    return path


def build_temporary_path(name: str) -> Path:
    """Return a path with the name `name` in a new temporary folder.

    The folder is created at once, so call this function only if there is content to write.
    """
    return Path(tempfile.mkdtemp(prefix="carom-")) / name


def _write_synchronised(path: Path, content: str | bytes) -> None:
    """Write a file and synchronise it to the disk."""
    with path.open("xb") as file:
        file.write(_encode_content(content))
        file.flush()
        os.fsync(file.fileno())


def _encode_content(content: str | bytes) -> bytes:
    """Return the content of a file as bytes. Control characters in text are escaped."""
    return escape_controls(content).encode() if isinstance(content, str) else content


def _is_incomplete(marker: Path) -> bool:
    """Return whether a marker is incomplete because its writing was interrupted."""
    purpose, _, rest = marker.read_text(encoding="utf-8", errors="replace").partition("\n")
    return re.fullmatch("[a-z]*", purpose) is not None and _MARKER_TEXT.startswith(rest) and rest != _MARKER_TEXT


def _complete_write(folder: Path) -> None:
    """Move complete new files to their places, and remove incomplete new files."""
    _remove_unfinished(folder / _NEW)
    committed = folder / _WHOLE
    if committed.is_dir():
        _synchronise_folder(folder)
        for name in sorted(os.listdir(committed)):
            (committed / name).replace(folder / name)
        _synchronise_folder(folder)
        committed.rmdir()


def _remove_unfinished(folder: Path) -> None:
    """Remove a temporary folder of unfinished files."""
    if folder.is_dir():
        shutil.rmtree(folder)


def _synchronise_folder(folder: Path) -> None:
    """Write a folder's list of files to the disk. Systems that can't open folders don't need this."""
    if hasattr(os, "O_DIRECTORY"):
        descriptor = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
        try:
            os.fsync(descriptor)
        finally:
            os.close(descriptor)
