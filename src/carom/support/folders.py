"""The folders that Carom writes into. It replaces and removes only what it wrote itself.

A folder of Carom's has a marker, a file that says what it is for. Carom writes into a folder that is new, empty, or
marked for the same purpose, and refuses every other; so no file of anybody else's is ever in its way.

Files that belong together appear together: they are written into a folder of their own, put on the disk, and the rename
of that folder is the moment at which they count. From then on they are moved to their places, by the next process if
need be. So after a kill or a loss of power at any moment the next command finds the old files or the new ones, whole.
"""

from __future__ import annotations

import hashlib
import os
import re
import tempfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

from carom.errors import InputError
from carom.support.escaping import visible

MARKER = ".carom"
#: After its first line, a word that says what the folder is for.
_SAYS = "Carom replaces the files that it wrote here.\n"
#: Next to the files: those that are being written, and those that are on the disk and count.
_NEW, _WHOLE = ".carom-new", ".carom-whole"

#: Longer names are cut, so that one with an ending and a temporary name stays below the 255 bytes of most systems.
_LONGEST_NAME = 100
#: Windows takes these for devices, whatever comes after the first full stop.
_DEVICES = re.compile(r"(con|prn|aux|nul|com[0-9]|lpt[0-9])(\.|$)")
_PLAIN = re.compile(r"[a-z0-9][a-z0-9_-]*(/[a-z0-9][a-z0-9_-]*)*")


def file_name(name: str) -> str:
    """Return what the file of something of this name is called, without an ending: another name for every name.

    A name of small letters, digits, ``-``, ``_`` and ``/`` stays readable, with ``.`` for ``/``. Any other gets a
    digest of itself, so that no two names share a file, even where a system takes capitals for small letters.
    """
    plain = name.replace("/", ".")
    if _PLAIN.fullmatch(name) and len(name) <= _LONGEST_NAME and not _DEVICES.match(plain):
        return plain
    kept = re.sub("[^a-z0-9]+", "-", name.lower())[: _LONGEST_NAME // 2].strip("-") or "name"
    return f"{kept}@{hashlib.sha256(name.encode(errors='surrogatepass')).hexdigest()[:16]}"


def claim(folder: Path, purpose: str, option: str = "") -> None:
    """Make a folder Carom's own, and finish what was broken off in it.

    Args:
        folder: The folder; it is made where it does not exist.
        purpose: What Carom writes there, as the marker says it: one word.
        option: The option that names the folder, for the message.

    Raises:
        InputError: The folder can't be made or written into, holds files of others, or serves another purpose.
    """
    another = f"name another folder{option and f' by {option}'}"
    try:
        folder.mkdir(parents=True, exist_ok=True)
        there = os.listdir(folder)
        if not there or (there == [MARKER] and _is_torn(folder / MARKER)):
            (folder / MARKER).unlink(missing_ok=True)
            _put(folder / MARKER, f"{purpose}\n{_SAYS}")
            return
        if not os.access(folder, os.W_OK | os.X_OK):
            raise InputError(f"{folder}: no permission to write there", hints=[another])
        if MARKER not in there:
            what = f"{folder} holds files that Carom did not write, such as {min(there)}"
            raise InputError(what, hints=[another])
        with (folder / MARKER).open(encoding="utf-8", errors="replace") as file:
            found = file.readline(100).strip()
    except OSError as error:
        raise InputError(f"{error.filename or folder}: {error.strerror or error}", hints=[another]) from None
    if found != purpose:
        what = f"{folder} is the folder of another command's files ({found}, not {purpose})"
        raise InputError(what, hints=[another])
    _finish(folder)


@contextmanager
def claimed(folder: Path, purpose: str, option: str = "") -> Iterator[None]:
    """As `claim`, before work whose results go there; a folder into which nothing came is as it was before."""
    new, marked = not folder.exists(), (folder / MARKER).exists()
    try:
        claim(folder, purpose, option)
        yield
    finally:
        if not marked and folder.is_dir() and os.access(folder, os.R_OK) and set(os.listdir(folder)) <= {MARKER}:
            (folder / MARKER).unlink(missing_ok=True)  # the process that claimed it again has removed it
            if new:
                folder.rmdir()


def write_files(folder: Path, purpose: str, contents: Mapping[str, str | bytes]) -> Path:
    """Write files into a folder of Carom's, all or none, replacing older ones; return the first.

    Raises:
        InputError: As `claim` says.
        OSError: They can't be written.
    """
    claim(folder, purpose)
    new = folder / _NEW
    new.mkdir()
    try:
        for name, content in contents.items():
            _put(new / name, content)
        _settle(new)
        new.rename(folder / _WHOLE)
    except BaseException:
        _remove(new)
        raise
    _finish(folder)
    return folder / next(iter(contents))


def write_file(path: Path, content: str | bytes) -> Path:
    """Write one file where somebody asked for it by name, whole, replacing an older one; return its path.

    A link is followed, and what is no file, a pipe or ``/dev/stdout`` say, is written to and stays what it is.

    Raises:
        OSError: It can't be written.
    """
    if path.exists() and not path.is_file():
        path.write_bytes(_bytes(content))
        return path
    place = path.resolve()
    place.parent.mkdir(parents=True, exist_ok=True)
    part = place.with_name(f".{file_name(place.name)}.{os.getpid()}.part")
    try:
        _put(part, content)
        part.replace(place)
    finally:
        part.unlink(missing_ok=True)
    _settle(place.parent)
    return path


def temporary(name: str) -> Path:
    """Return a path of that name in a new folder for temporary files; ask only when there is what to write."""
    return Path(tempfile.mkdtemp(prefix="carom-")) / name


def _put(path: Path, content: str | bytes) -> None:
    """Write a file and see it onto the disk."""
    with path.open("xb") as file:
        file.write(_bytes(content))
        file.flush()
        os.fsync(file.fileno())


def _bytes(content: str | bytes) -> bytes:
    """Return what goes into a file: text without control characters."""
    return visible(content).encode() if isinstance(content, str) else content


def _is_torn(marker: Path) -> bool:
    """Whether a marker is the beginning of one: a full disk or a kill came between."""
    purpose, _, rest = marker.read_text(encoding="utf-8", errors="replace").partition("\n")
    return re.fullmatch("[a-z]*", purpose) is not None and _SAYS.startswith(rest) and rest != _SAYS


def _finish(folder: Path) -> None:
    """Move files that count to their places, and remove what was not finished."""
    _remove(folder / _NEW)
    whole = folder / _WHOLE
    if whole.is_dir():
        _settle(folder)
        for name in sorted(os.listdir(whole)):
            (whole / name).replace(folder / name)
        _settle(folder)
        whole.rmdir()


def _remove(folder: Path) -> None:
    """Remove a folder of files that Carom has begun to write."""
    if folder.is_dir():
        for name in os.listdir(folder):
            (folder / name).unlink()
        folder.rmdir()


def _settle(folder: Path) -> None:
    """See the names in a folder onto the disk; where the system can't open a folder, it does so by itself."""
    if hasattr(os, "O_DIRECTORY"):
        descriptor = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
        try:
            os.fsync(descriptor)
        finally:
            os.close(descriptor)
