"""Complaints: scenes that reproduce what users of collision engines reported, each with its thread."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from functools import partial

from carom.catalogue.entry import CatalogueScene, listed


class Symptom(StrEnum):
    """What was reported, as something that can be seen in a trace; the value is the phrase shown."""

    MISSES = "an impact is missed"
    INVENTS = "an impact is invented"
    WRONG_VELOCITY = "a velocity after an impact is wrong"
    GAINS_ENERGY = "energy is gained"
    LOSES_ENERGY = "energy is lost"
    NEVER_RESTS = "a body moves that should have come to rest"
    ESCAPES = "a body ends inside another or beyond a wall"
    NOT_FINITE = "the state is no longer a number"
    NEVER_ENDS = "the run does not end"


#: What goes by another name than its repository.
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
        reported: What the thread reports, in our words.
        symptom: What to look for in a trace.
        at_least: How large an error counts as what was reported, as a share of the scene's speed or energy: a per cent,
            which people notice, unless the report is of more.
        made: What of the scene is the thread's and what was chosen here.
        package: Name of what the thread is about, where its repository doesn't say it.
    """

    thread: str = ""
    reported: str = ""
    symptom: Symptom = Symptom.WRONG_VELOCITY
    at_least: float = 0.01
    made: str = ""
    package: str = ""

    @property
    def about(self) -> str:
        """What the thread is about: an engine or package by its own name."""
        repository = self.thread.split("/")[4]
        return self.package or _PACKAGES.get(repository, repository)

    @property
    def engine(self) -> str:
        """Name of Carom's adapter that drives what the thread is about; empty where there is none."""
        return _ADAPTERS.get(self.about, "")


#: Makes of a builder, as `listed` does, a complaint with the fields given by name.
complained = partial(listed, "issues", kind=Complaint)

#: The same of what is reported most.
misses = partial(complained, symptom=Symptom.MISSES)
loses_energy = partial(complained, symptom=Symptom.LOSES_ENERGY)
gains_energy = partial(complained, symptom=Symptom.GAINS_ENERGY)
#: A velocity that is wrong as that of a body which keeps to what it should bounce off, or bounces by far too little.
never_bounces = partial(complained, at_least=0.25)
