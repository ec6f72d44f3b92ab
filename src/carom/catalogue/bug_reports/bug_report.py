"""Scenes that reproduce bug reports by users of collision engines, each with the address of its thread."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import dataclass
from enum import StrEnum
from functools import partial
from pathlib import Path

from carom.catalogue.entry import CatalogueScene


class Symptom(StrEnum):
    """Symptoms of reported bugs, with their text for reports. Each symptom can be found in the results of a run."""

    MISSES = "an impact is missed"
    INVENTS = "an impact is invented"
    WRONG_VELOCITY = "a velocity after an impact is wrong"
    GAINS_ENERGY = "energy is gained"
    LOSES_ENERGY = "energy is lost"
    NEVER_RESTS = "a body that should have come to rest still moves"
    ESCAPES = "a body ends inside another or beyond a wall"
    NOT_FINITE = "the state is no longer a number"
    NEVER_ENDS = "the run does not end"


@dataclass(frozen=True)
class BugReport(CatalogueScene):
    """A scene of the group `issues`.

    Attributes:
        thread: Web address of the thread that contains the report.
        summary: Summary of the report in the thread.
        symptom: Symptom by which the bug is found in the results of a run.
        smallest_error: Smallest error that counts as the reported bug, as a fraction of the scene's speed or energy.
            The default is one per cent, since users notice such an error.
        number_sources: Which numbers of the scene are from the thread, and which were chosen for the catalogue.
        about: Name of the engine or package that the report is about.
        engine: Name of Carom's adapter of that engine; empty if there is none.
    """

    thread: str = ""
    summary: str = ""
    symptom: Symptom = Symptom.WRONG_VELOCITY
    smallest_error: float = 0.01
    number_sources: str = ""
    about: str = ""
    engine: str = ""


def load_bug_reports() -> Iterator[BugReport]:
    """Yield all bug reports, in the order of ``bug_reports.json``.

    The file groups the reports by module. The field `build` of a report names the function that builds the scene, such
    as `head_on` of the report's module, or `groups.driven.stage_on_lift`. By default, the function has the name of the
    scene. The function's docstring is the default description of the scene. Strings in `arguments` are complex numbers.
    """
    # Most commands don't need these scenes, so they are imported only here.
    from carom.catalogue.bug_reports import driven, falling, pairs, rolling, seams, thin, walled
    from carom.catalogue.groups import classics_walled
    from carom.catalogue.groups import driven as driven_group

    modules = {
        module.__name__.removeprefix("carom.catalogue.").removeprefix("bug_reports."): module
        for module in (driven, falling, pairs, rolling, seams, thin, walled, classics_walled, driven_group)
    }
    reports = json.loads(Path(__file__).with_name("bug_reports.json").read_text(encoding="utf-8"))
    for default_module, of_module in reports.items():
        for name, fields in of_module.items():
            module, _, builder = fields.pop("build", name.replace("-", "_")).rpartition(".")
            function = getattr(modules[module or default_module], builder)
            arguments = fields.pop("arguments", {})
            vectors = {key: complex(value) for key, value in arguments.items() if isinstance(value, str)}
            description = fields.pop("shows", "") or " ".join((function.__doc__ or "").split())
            fields["symptom"] = Symptom(fields.get("symptom", Symptom.WRONG_VELOCITY))
            yield BugReport(f"issues/{name}", description, partial(function, **arguments | vectors), **fields)
