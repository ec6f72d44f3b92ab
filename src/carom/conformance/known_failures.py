"""Known failures: a file of their author's, each with a reason, and strict: what no longer fails must leave it.

::

    [[known_failure]]
    reason = "the engine shrinks a contact by its margin; example.org/issues/12"
    cases = ["penalty::velocities[default-classics/graze]"]
"""

from __future__ import annotations

import difflib
from collections.abc import Collection, Mapping
from pathlib import Path

from carom.arguments import shown
from carom.data_files import read_data
from carom.errors import InputError

__all__ = ["FILE_NAME", "check_names", "load_known_failures"]

FILE_NAME = "carom-known-failures.toml"


def load_known_failures(path: Path) -> dict[str, str]:
    """Return the reason of each known failure, by the full name of its case.

    Raises:
        InputError: The file can't be read or is not of the form above; the message names the entry.
    """
    try:
        data = read_data(path, ".toml")
    except InputError as error:
        raise InputError(f"{path}: {error}") from None
    entries = data.pop("known_failure", [])
    if data:
        raise InputError(f"{path}: {shown(next(iter(data)))} is unknown; there is [[known_failure]]")
    if not isinstance(entries, list):
        raise InputError(f"{path}: known_failure must be a list of tables, each under [[known_failure]]")
    reasons: dict[str, str] = {}
    for number, entry in enumerate(entries, start=1):
        where = f"{path}: known_failure {number}"
        for name, reason in _entry(entry, where):
            if name in reasons:
                raise InputError(f"{where}: {shown(name)} is listed twice")
            reasons[name] = reason
    return reasons


def _entry(entry: object, where: str) -> list[tuple[str, str]]:
    if not isinstance(entry, dict):
        raise InputError(f"{where}: must be a table with `reason` and `cases`, got {shown(entry)}")
    unknown = sorted(set(entry) - {"reason", "cases"})
    if unknown:
        raise InputError(f"{where}: {shown(unknown[0])} is unknown; there are: reason, cases")
    reason, names = entry.get("reason"), entry.get("cases")
    if not (isinstance(reason, str) and reason.strip()):
        raise InputError(f"{where}: reason must be a sentence that says why, got {shown(reason)}")
    if not (isinstance(names, list) and names and all(isinstance(name, str) for name in names)):
        raise InputError(f"{where}: cases must be a list of names such as 'penalty::energy[tuned]', got {shown(names)}")
    return [(name, reason.strip()) for name in names]


def check_names(
    known: Mapping[str, str], names: Collection[str], skipped: Mapping[str, str], installed: Collection[str], path: Path
) -> None:
    """Hold the names of a file against the cases that there are.

    Args:
        known: What the file lists.
        names: Full names of all cases of the engines that are run.
        skipped: Those of them that a declared capability excludes, with the reason.
        installed: Names of all engines; a case of one that is not run this time is let pass.
        path: The file.

    Raises:
        InputError: A name is of no case, or of one that can't fail since it is skipped.
    """
    run = {name.partition("::")[0] for name in names}
    for name in known:
        engine = name.partition("::")[0]
        if engine in installed and engine not in run:
            continue
        if name not in names:
            near = difflib.get_close_matches(name, names, n=1)
            hint = (
                f"; did you mean {near[0]!r}?"
                if near
                else "; `pytest --carom-engine NAME --collect-only -q` lists them"
            )
            raise InputError(f"{path}: there is no case {shown(name)}{hint}")
        if name in skipped:
            raise InputError(f"{path}: {name!r} can't fail, it is skipped: {skipped[name]}; take it out")
