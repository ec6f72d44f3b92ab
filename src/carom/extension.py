"""Whether Carom's compiled extension serves: said here, and nowhere else.

Every .pyx file of the package becomes a module of the extension. They are built together or not at all, so
`carom.built` stands for them all. Where they are not there, plain Python serves, many times slower, with the same bits.

What chooses between the two forms asks `extension_available` when a run starts, and adds `extension_notes` to what
the run has to say; a loop in plain Python that may take long has a `Patience`.
"""

from __future__ import annotations

import functools
import importlib
import os
import time
import warnings
from pathlib import Path

#: Set to anything but nothing, it makes plain Python serve although the extension is there.
PLAIN_VARIABLE = "CAROM_PLAIN"

#: A user's flow of thought survives a second of waiting: J. Nielsen, "Usability Engineering" (1993), 5.5.
_LONG_S = 1.0


class PlainFormWarning(UserWarning):
    """A run takes long because the compiled extension does not serve."""


@functools.cache
def extension_available() -> bool:
    """Return whether the compiled forms serve; warn where they were built of other sources than those next to them."""
    available = not _absence()
    if available and _staleness():
        warnings.warn(_staleness(), StaleExtensionWarning, stacklevel=2)
    return available


def extension_notes() -> tuple[str, ...]:
    """Return what a result must say of the form that ran, with a remedy; nothing where all is compiled."""
    said = _staleness() if extension_available() else _absence()
    return (said,) if said else ()


class StaleExtensionWarning(UserWarning):
    """The compiled extension does not do what the sources next to it say."""


class Patience:
    """The wait for one run in plain Python: the first of a process to take over a second is warned of."""

    def __init__(self) -> None:
        self._ends = time.monotonic() + _LONG_S

    def look(self) -> None:
        """Warn where the run has become long for want of the extension; costs little enough for a loop."""
        if time.monotonic() > self._ends and not extension_available():
            _warn()


def sources_digest() -> str:
    """Return a digest of all sources of the extension, with their names: .pyx, .pxd, .h and .c files.

    The build calls this function too, so it must not import Carom.
    """
    import hashlib

    package = Path(__file__).parent
    digest = hashlib.sha256()
    for path in _sources(package):
        source = path.read_bytes().replace(b"\r\n", b"\n")  # as git may check it out on Windows
        digest.update(f"{path.relative_to(package).as_posix()} {len(source)}\n".encode() + source)
    return digest.hexdigest()


def _sources(package: Path) -> list[Path]:
    """Return all sources of the extension."""
    kinds = (".pyx", ".pxd", ".h", ".c")  # in one walk, because each process that runs a scene calls this
    found = [Path(folder, name) for folder, _, names in os.walk(package) for name in names if name.endswith(kinds)]
    return sorted(path for path in found if not path.is_relative_to(package / "core/wasm"))  # the page's: core.wasm


def _absence() -> str:
    """Return why the extension does not serve, and the remedy; nothing where it does."""
    effect = "so plain Python runs: the same results, many times slower"
    if os.environ.get(PLAIN_VARIABLE):
        return f"{PLAIN_VARIABLE} is set, {effect}; unset it for the compiled extension"
    try:
        importlib.import_module("carom.built")
    except ImportError as error:
        return (
            f"the compiled extension is not there ({error}), {effect}; "
            "install a C compiler, then Carom anew, with pip's --force-reinstall --no-deps --no-cache-dir"
        )
    return ""


@functools.cache
def _staleness() -> str:
    """Return that the extension is not of the sources next to it, and the remedy; nothing where it is.

    Only where it is used from a source tree, as an editable install is: what was installed is not edited. Whether it is
    older than a source says whether it is worth looking into the sources.
    """
    package = Path(__file__).parent
    if {"site-packages", "dist-packages"} & set(package.parts):
        return ""
    built = importlib.import_module("carom.built")
    made = os.stat(str(built.__file__)).st_mtime
    if all(path.stat().st_mtime <= made for path in _sources(package)) or sources_digest() == built.DIGEST:
        return ""
    return (
        f"the compiled extension is not of the sources in {package}, one of which has changed since: build it again "
        "with python setup.py build_ext --inplace --force"
    )


@functools.cache
def _warn() -> None:
    warnings.warn(_absence(), PlainFormWarning, stacklevel=3)
