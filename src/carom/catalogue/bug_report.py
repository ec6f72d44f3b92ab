"""Complaints: scenes that reproduce bug reports by users of collision engines, each with the thread's address."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from functools import partial

from carom.catalogue.entry import CatalogueScene, listed


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


#: Decorator like `listed` that turns a builder into a complaint. Keywords set its fields.
complained = partial(listed, "issues", kind=Complaint)

#: Decorators of the most frequent symptoms.
misses = partial(complained, symptom=Symptom.MISSES)
loses_energy = partial(complained, symptom=Symptom.LOSES_ENERGY)
gains_energy = partial(complained, symptom=Symptom.GAINS_ENERGY)
#: Decorator of a wrong velocity: the body sticks where it should bounce, or bounces far too little.
never_bounces = partial(complained, at_least=0.25)
