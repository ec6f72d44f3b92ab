"""State of the compiled extension: whether it is installed, and whether it was built from the current sources.

Every .pyx file of the package is a module of the extension. All modules are built together. So the digest of the
sources in `carom.core.built` is valid for all of them.
"""

from __future__ import annotations

import functools
import importlib
import os
import warnings
from pathlib import Path


class StaleExtensionWarning(UserWarning):
    """The compiled extension was not built from the sources next to it."""


def require_extension() -> None:
    """Check that the compiled extension is installed.

    Raises:
        ImportError: The extension is not installed, or can't be loaded. The message contains the remedy.
    """
    try:
        importlib.import_module("carom.core.built")
    except ImportError as error:
        package = Path(__file__).parents[1]
        remedy = (
            "install Carom again, with pip's --force-reinstall --no-deps --no-cache-dir"
            if _is_installed(package)
            else "build it with python setup.py build_ext --inplace, or install the source tree with pip"
        )
        raise ImportError(f"Carom's compiled extension in {package} cannot be loaded ({error}); {remedy}") from None


def find_extension_notes() -> tuple[str, ...]:
    """Return a note for results if the extension was not built from the current sources, otherwise nothing.

    If there is a note, a warning is also issued, once per process.
    """
    stale = _find_staleness()
    if stale:
        _warn(stale)
    return (stale,) if stale else ()


def compute_sources_digest() -> str:
    """Return a digest of the names and contents of the extension's sources: .pyx, .pxd, .h and .c files.

    The build calls this function too, so it must not import Carom.
    """
    import hashlib

    package = Path(__file__).parents[1]
    digest = hashlib.sha256()
    for path in _list_sources(package):
        source = path.read_bytes().replace(b"\r\n", b"\n")  # on Windows, git may write line ends as CR LF
        digest.update(f"{path.relative_to(package).as_posix()} {len(source)}\n".encode() + source)
    return digest.hexdigest()


def _list_sources(package: Path) -> list[Path]:
    """Return all sources of the extension."""
    found: list[Path] = []
    for folder, folders, names in os.walk(package):
        # core/wasm contains the sources of core.wasm, which is not part of the extension.
        folders[:] = [name for name in folders if name not in {"wasm", "__pycache__"}]
        found += [Path(folder, name) for name in names if name.endswith((".pyx", ".pxd", ".h", ".c"))]
    return sorted(found)


def _is_installed(package: Path) -> bool:
    """Whether a package is an installed copy and not a source tree. Nobody edits the sources of an installed copy."""
    return bool({"site-packages", "dist-packages"} & set(package.parts))


@functools.cache
def _find_staleness() -> str:
    """Return a message if the extension was not built from the sources next to it, otherwise an empty text.

    To save time, the digest of the sources is computed only if a source is newer than the extension.
    """
    package = Path(__file__).parents[1]
    if _is_installed(package):
        return ""
    built = importlib.import_module("carom.core.built")
    built_s = os.stat(str(built.__file__)).st_mtime
    if (
        all(path.stat().st_mtime <= built_s for path in _list_sources(package))
        or compute_sources_digest() == built.DIGEST
    ):
        return ""
    return (
        f"the sources in {package} have changed since the compiled extension was built: "
        "build it again with python setup.py build_ext --inplace --force"
    )


@functools.cache
def _warn(stale: str) -> None:
    warnings.warn(stale, StaleExtensionWarning, stacklevel=3)
