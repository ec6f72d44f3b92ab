"""Exceptions of the checks. A failure contains the expected value, the found value, and the run with the failure."""

from __future__ import annotations

from dataclasses import dataclass

from carom.conformance.suite_scenes import DT_S
from carom.errors import CaromError
from carom.model.scene import Scene
from carom.support.formatting import format_step_option


@dataclass(frozen=True)
class Setup:
    """The scene, the profile and the step size of a run in a check.

    Attributes:
        scene: The scene.
        profile: Name of the profile.
        dt_s: Step size, in seconds.
        catalogued: Whether `carom run` finds the scene by its name, because the scene is in the catalogue.
    """

    scene: Scene
    profile: str = "tuned"
    dt_s: float = DT_S
    catalogued: bool = False

    def __str__(self) -> str:
        return f"{self.scene.name!r}, profile {self.profile!r}, dt = {format_step_option(self.dt_s)} s"


class Violation(CaromError):  # noqa: N818 - this is the result of a check, not an error of the suite
    """An adapter violates its interface or its declarations.

    Attributes:
        what: What is wrong, in a sentence.
        expected: Expected value.
        found: Found value.
        setup: The run with the violation; None if no scene was run.
    """

    def __init__(self, problem: str, expected: object, found: object, setup: Setup | None = None) -> None:
        self.what, self.expected, self.found, self.setup = problem, str(expected), str(found), setup
        super().__init__(f"{problem}: expected {self.expected}, got {self.found}" + (f" in {setup}" if setup else ""))


class NotApplicable(CaromError):  # noqa: N818 - this is a reason to skip, not an error
    """Raised if a check does not apply, for example because a capability is not declared. The message is the reason."""


def require(holds: bool, problem: str, expected: object, found: object, setup: Setup | None = None) -> None:
    """Raise a `Violation` if a condition does not hold."""
    if not holds:
        raise Violation(problem, expected, found, setup)
