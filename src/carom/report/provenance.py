"""Origin of a report: the machine, versions of packages, and the command that reproduces it."""

from __future__ import annotations

import shlex
from collections.abc import Iterator, Sequence

from carom.engines.registry import format_engine_argument
from carom.execution.environment import Environment
from carom.execution.job import Method
from carom.report.document import Code, Facts, Media, Section
from carom.support import formatting


def build_provenance(environment: Environment, command: str, elapsed_s: float) -> Iterator[Section]:
    """Yield the sections with machine, versions and command."""
    facts = (*_list_facts(environment), ("Whole run", formatting.format_seconds(elapsed_s)))
    yield Section("Machine and versions", (Facts(facts),))
    yield Section("Made by", (Code(command, Media.ON_PAPER),) if command else (), level=3)


def format_stamp_lines(environment: Environment, command: str) -> tuple[str, ...]:
    """Return machine, versions and command in a few lines, for the bottom of a diagram that is saved as a file."""
    facts = [value for _, value in _list_facts(environment)]
    return ("; ".join(facts[:3]), "; ".join(facts[3:]), command)


def _list_facts(environment: Environment) -> tuple[tuple[str, str], ...]:
    return (
        ("Date", environment.date),
        ("Processor", f"{environment.processor}, {formatting.format_count(environment.cores, 'core')}"),
        ("System", environment.system),
        ("Python", environment.python),
        ("Carom", f"Carom {environment.carom}"),
        ("Versions", ", ".join(f"{name} {version}" for name, version in environment.versions.items())),
    )


def format_command(words: Sequence[str], method: Method, *options: str) -> str:
    """Return a command of Carom for a method. `words` are the name of the command and its scenes."""
    return shlex.join(("carom", *words, "-e", format_engine_argument(method.engine), "-p", method.profile, *options))
