"""Registry clients (pip and npm), which list the releases of a package and install a release into a folder.

No code of a package runs during installation: pip only installs wheels, and npm runs no scripts. The run time and the
output of a client are limited. When a call ends, no process of the client continues.
"""

from __future__ import annotations

import json
import os
import re
import shutil
import signal
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any, Protocol

from carom.errors import CaromError
from carom.support.escaping import find_last_message, format_value
from carom.support.versions import require_version

#: Time limits of listing and installing, in seconds. Listing the releases takes a few seconds. Installing the largest
#: tested release, 300 MB, takes half a minute.
LISTING_S, INSTALLING_S = 60.0, 600.0
#: Largest number of bytes read from a client's output. The list of a thousand releases is a hundred times smaller than
#: this number.
MOST_PRINTED_BYTES = 2**22

_NAME = re.compile(r"(@[a-z0-9][a-z0-9._-]*/)?[A-Za-z0-9][A-Za-z0-9._-]*")


class ClientError(CaromError):
    """A client is missing, does not respond, or reports an error. The message contains the client's last error line."""


class Client(Protocol):
    """A program that lists and installs the releases of packages."""

    def list_versions(self, package: str) -> tuple[str, ...]:
        """Return the versions that the registry lists for a package, in no order.

        Raises:
            ClientError: The registry is unreachable, or does not have the package.
        """

    def install(self, package: str, version: str, folder: Path) -> tuple[str, ...]:
        """Install a release with its missing requirements into an empty folder, and return the installed packages.

        Raises:
            ClientError: The registry is unreachable, or does not have the release for this machine.
        """


class Pip:
    """The pip of this environment, which installs releases as wheels into a folder.

    To use a release, its folder must be first on Python's path.
    """

    def list_versions(self, package: str) -> tuple[str, ...]:
        """Return the versions that the registry lists for a package."""
        printed = _run([*_PIP, "index", "versions", *_LIMITS, _check_name(package)], LISTING_S)
        found = re.search(r"^Available versions: (.*)$", printed, re.MULTILINE)
        if found is None:
            raise ClientError(f"pip lists no versions of {package}: it printed {format_value(printed)}")
        return tuple(word.strip() for word in found[1].split(","))

    def install(self, package: str, version: str, folder: Path) -> tuple[str, ...]:
        """Install a release and its missing requirements from wheels into an empty folder."""
        requirement = f"{_check_name(package)}=={require_version(version)}"
        words = [*_PIP, "install", "--dry-run", "--quiet", *_LIMITS, *_WHEELS, "--report", "-", requirement]
        report = _read_json(_run(words, LISTING_S), "pip")
        try:
            found = [(one["metadata"]["name"], one["metadata"]["version"]) for one in report["install"]]
        except (KeyError, TypeError):
            raise ClientError("pip's report has an unknown form: it contains no list of packages to install") from None
        resolved = [f"{_check_name(name)}=={require_version(one)}" for name, one in found]
        needed = (one for one in resolved if _normalize_name(one) != _normalize_name(requirement))
        needs = tuple(dict.fromkeys((requirement, *needed)))
        # `--no-deps` is correct, because the list of packages already includes all requirements that are not installed.
        into = ["--no-deps", "--target", str(folder)]
        _run([*_PIP, "install", "--quiet", *_LIMITS, *_WHEELS, *into, *needs], INSTALLING_S)
        return needs


class Npm:
    """npm, which installs a release with its requirements in the `node_modules` of a folder."""

    def list_versions(self, package: str) -> tuple[str, ...]:
        """Return the versions that the registry lists for a package."""
        words = ["npm", "view", *_QUIET, "--json", "--", _check_name(package), "versions"]
        found = _read_json(_run(words, LISTING_S), "npm")
        versions = [found] if isinstance(found, str) else found  # npm prints no list if there is only one version
        if not isinstance(versions, list) or not all(isinstance(one, str) for one in versions):
            raise ClientError(f"npm lists no versions of {package}: it printed {format_value(found)}")
        return tuple(versions)

    def install(self, package: str, version: str, folder: Path) -> tuple[str, ...]:
        """Install a release into the `node_modules` of an empty folder, without running packages' scripts."""
        needs = {_check_name(package): require_version(version)}
        (folder / "package.json").write_text(json.dumps({"private": True, "dependencies": needs}), encoding="utf-8")
        words = ["npm", "install", *_QUIET, "--ignore-scripts", "--no-package-lock", "--prefix", str(folder)]
        _run(words, INSTALLING_S, folder)
        package_file = folder / "node_modules" / package / "package.json"
        if not package_file.is_file():
            raise ClientError(f"npm did not install {package} {version}")
        return (f"{package}@{version}",)


#: Clients by name.
CLIENTS: dict[str, Client] = {"pip": Pip(), "npm": Npm()}

_PIP = (sys.executable, "-m", "pip", "--no-input", "--disable-pip-version-check")
#: Options of pip: a single retry, and short time-outs.
_LIMITS = ("--retries", "1", "--timeout", "15")
_WHEELS = ("--only-binary", ":all:")
_QUIET = ("--no-audit", "--no-fund", "--no-update-notifier", "--fetch-retries", "1", "--fetch-timeout", "30000")


def _check_name(package: str) -> str:
    """Return a package's name, or raise an error if the name could be mistaken for an option or a path."""
    if not _NAME.fullmatch(package):
        raise ClientError(f"{format_value(package)} is not a package name")
    return package


def _normalize_name(requirement: str) -> str:
    return re.sub(r"[-_.]+", "-", requirement.partition("==")[0]).lower()


def _read_json(text: str, client: str) -> Any:
    try:
        return json.loads(text)
    except (ValueError, RecursionError):
        raise ClientError(f"{client} did not print JSON: {format_value(text)}") from None


def _run(words: Sequence[str], most_s: float, folder: Path | None = None) -> str:
    """Run a client, and return its standard output.

    Raises:
        ClientError: The client is missing, fails, or takes too long.
    """
    client = "pip" if words[0] == sys.executable else words[0]
    program = shutil.which(words[0])
    if program is None:
        raise ClientError(f"{client} is not on the PATH")
    with (
        tempfile.TemporaryFile() as printed,
        tempfile.TemporaryFile() as error_output,
        tempfile.TemporaryDirectory(prefix="carom-client-") as elsewhere,
    ):
        process = subprocess.Popen(  # noqa: S603 - pip or npm, with a checked name and version
            [program, *words[1:]],
            stdin=subprocess.DEVNULL,
            stdout=printed,
            stderr=error_output,
            cwd=folder or elsewhere,  # npm would read an .npmrc in the user's folder
            start_new_session=True,
        )
        try:
            code = process.wait(most_s)
        except subprocess.TimeoutExpired:
            raise ClientError(f"{client} did not finish within {most_s:g} s") from None
        finally:
            if process.poll() is None:  # after the time limit or Ctrl-C, also end child processes
                with suppress(ProcessLookupError):
                    os.killpg(process.pid, signal.SIGKILL)
                process.wait()
        texts = []
        for file in (printed, error_output):
            file.seek(0)
            texts.append(file.read(MOST_PRINTED_BYTES).decode(errors="replace"))
    if code:
        why = _find_error_line(texts[1]) or _find_error_line(texts[0])
        raise ClientError(f"{client}: {why or f'exit code {code}'}")
    return texts[0]


def _find_error_line(text: str) -> str:
    lines = [line for line in text.splitlines() if not re.match(r"\s*(WARNING|npm warn|\[notice\])", line)]
    errors = [line for line in lines if line.startswith(("ERROR", "npm error"))]
    return find_last_message("\n".join(errors or lines))
