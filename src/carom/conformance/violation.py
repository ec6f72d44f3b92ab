"""What a failed check says: what is wrong, the value found, the value expected, the scene, and how to see it again."""

from __future__ import annotations

from dataclasses import dataclass

from carom.conformance.suite_scenes import DT_S
from carom.errors import CaromError
from carom.model.scene import Scene


def step_text(dt_s: float) -> str:
    """Return a step as people write it: ``1/240`` where it is the inverse of a whole number."""
    rate = round(1 / dt_s)
    return f"1/{rate}" if rate > 0 and 1 / rate == dt_s else repr(dt_s)


@dataclass(frozen=True)
class Setup:
    """One run: a scene with a profile at a step.

    Attributes:
        scene: The scene.
        profile: Name of the profile.
        dt_s: Step, seconds.
        catalogued: Whether `carom run` knows the scene by its name.
    """

    scene: Scene
    profile: str = "tuned"
    dt_s: float = DT_S
    catalogued: bool = False

    def __str__(self) -> str:
        return f"{self.scene.name!r}, profile {self.profile!r}, dt = {step_text(self.dt_s)} s"


class Violation(CaromError):  # noqa: N818 - what a check finds; the suite itself has no error
    """An adapter does not do what the seam asks of it, or what it declares.

    Attributes:
        what: What is wrong, in a sentence.
        expected: What should have been found.
        found: What was found.
        setup: The run in which it shows; None where no scene was run.
    """

    def __init__(self, what: str, *, expected: object, found: object, setup: Setup | None = None) -> None:
        self.what, self.expected, self.found, self.setup = what, str(expected), str(found), setup
        super().__init__(f"{what}: expected {self.expected}, got {self.found}" + (f" in {setup}" if setup else ""))


class NotApplicable(CaromError):  # noqa: N818 - a reason to skip, no error
    """What a check is about is declared not to be there, or can't be seen on this system; the message is the reason."""


def require(holds: bool, what: str, expected: object, found: object, setup: Setup | None = None) -> None:
    """Find a violation where something does not hold."""
    if not holds:
        raise Violation(what, expected=expected, found=found, setup=setup)
