"""Complaints: scenes that reproduce bug reports by users of collision engines, each with the thread's address."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import dataclass
from enum import StrEnum
from functools import cache, partial
from pathlib import Path
from types import ModuleType
from typing import Any

from carom.catalogue.entry import CatalogueScene


class Symptom(StrEnum):
    """Symptoms of reported bugs that a trace shows; the value is the phrase shown."""

    MISSES = "an impact is missed"
    INVENTS = "an impact is invented"
    WRONG_VELOCITY = "a velocity after an impact is wrong"
    GAINS_ENERGY = "energy is gained"
    LOSES_ENERGY = "energy is lost"
    NEVER_RESTS = "a body moves that should have come to rest"
    ESCAPES = "a body ends inside another or beyond a wall"
    NOT_FINITE = "the state is no longer a number"
    NEVER_ENDS = "the run does not end"


#: Names of packages that differ from their repositories.
_PACKAGES = {
    "avian": "Avian",
    "box2d": "Box2D",
    "bullet3": "Bullet",
    "Construct-bugs": "Construct 3",
    "godot": "Godot",
    "godot-jolt": "Jolt Physics",
    "JoltPhysics": "Jolt Physics",
    "matter-js": "matter.js",
    "mujoco": "MuJoCo",
    "newton": "Newton",
    "planck.js": "Planck",
    "rapier": "Rapier",
    "reactphysics3d": "ReactPhysics3D",
}
_ADAPTERS = {
    "Box2D": "box2d",
    "Bullet": "pybullet",
    "Jolt Physics": "jolt",
    "MuJoCo": "mujoco",
    "Newton (MuJoCo Warp)": "mujoco",
    "Rapier": "rapier",
}


@dataclass(frozen=True)
class Complaint(CatalogueScene):
    """A scene of the group `issues`.

    Attributes:
        thread: Address of the thread.
        reported: Summary of the report in the thread.
        symptom: Symptom to find in a trace.
        at_least: Least error that counts as the reported error, relative to the scene's speed or energy. The default of
            one per cent is noticeable.
        made: Which parts of the scene are from the thread, and which were chosen here.
        package: Name of the engine or package, if it differs from the repository's.
    """

    thread: str = ""
    reported: str = ""
    symptom: Symptom = Symptom.WRONG_VELOCITY
    at_least: float = 0.01
    made: str = ""
    package: str = ""

    @property
    def about(self) -> str:
        """Name of the engine or package in the thread."""
        repository = self.thread.split("/")[4]
        return self.package or _PACKAGES.get(repository, repository)

    @property
    def engine(self) -> str:
        """Name of Carom's adapter of that engine; empty if there is none."""
        return _ADAPTERS.get(self.about, "")


def load_complaints(module: ModuleType) -> Iterator[Complaint]:
    """Yield the complaints whose scenes a module builds, in the order of ``bug_reports.json``.

    There, `build` names a function of the module, and a text in `arguments` is a complex number. By default, the
    function has the name of the scene, and its docstring is the description of the scene.
    """
    for name, fields in _read_reports()[module.__name__.rpartition(".")[2]].items():
        build, shows = fields.get("build", name.replace("-", "_")), fields.get("shows")
        function = getattr(module, build)
        arguments = fields.get("arguments", {}).items()
        yield Complaint(
            f"issues/{name}",
            shows or " ".join(function.__doc__.split()),
            partial(function, **{key: complex(value) if isinstance(value, str) else value for key, value in arguments}),
            symptom=Symptom(fields.get("symptom", Symptom.WRONG_VELOCITY)),
            **{key: fields[key] for key in ("thread", "reported", "at_least", "made", "package") if key in fields},
        )


@cache
def _read_reports() -> dict[str, dict[str, dict[str, Any]]]:
    reports: dict[str, dict[str, dict[str, Any]]] = json.loads(
        Path(__file__).with_name("bug_reports.json").read_text(encoding="utf-8")
    )
    return reports
