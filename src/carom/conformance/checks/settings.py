"""Settings: read back as asked for, and refused where they would be without effect; and the start as written."""

from __future__ import annotations

from carom.conformance.checks.common import own_setup
from carom.conformance.probe import Raised
from carom.conformance.scenes import crowd
from carom.conformance.subject import Subject
from carom.conformance.violation import Violation

__all__ = ["refuses_unknown_setting", "settings_are_read_back", "starts_as_written"]

UNKNOWN = "carom_no_such_setting"


def settings_are_read_back(subject: Subject, profile: str) -> None:
    """A world reports every setting of its profile, with the value that was asked for."""
    setup = own_setup(crowd(), profile)
    asked = subject.settings(profile, setup.dt_s)
    used = subject.seen(setup).settings
    for name, value in asked.items():
        if name not in used or used[name] != value:
            found = f"{name} = {used[name]!r}" if name in used else f"no {name}, but {', '.join(used)}"
            raise Violation(
                "a setting is not the one asked for", expected=f"{name} = {value!r}", found=found, setup=setup
            )


def refuses_unknown_setting(subject: Subject) -> None:
    """A setting that would be without effect is an AdapterError that names it."""
    setup = own_setup(crowd(), "tuned")
    answer = subject.try_to_watch(setup, **{UNKNOWN: 1})
    what, expected = (
        "a setting that does not exist is accepted",
        f"prepare() to raise an AdapterError naming {UNKNOWN!r}",
    )
    if not isinstance(answer, Raised):
        raise Violation(what, expected=expected, found="a run to the end of the scene", setup=setup)
    if answer.where != "prepare" or not answer.deliberate or UNKNOWN not in answer.message:
        found = f"{answer.where}() raised {answer.kind}: {answer.message}"
        raise Violation(
            "a setting that does not exist is refused unclearly", expected=expected, found=found, setup=setup
        )


def starts_as_written(subject: Subject, profile: str) -> None:
    """Before its first step a world is in the scene's start state, to the declared width of numbers, untouched."""
    setup = own_setup(crowd(), profile)
    start = subject.seen(setup).seen[0]
    # The nearest number of the declared width is all that can be asked for, and no less can.
    relative = 2.0**-53 if subject.capabilities().float_bits == 64 else 2.0**-24
    for i, disc in enumerate(setup.scene.discs):
        for field, asked, found in (
            ("position_m", disc.position_m, start.position_m[i]),
            ("velocity_m_s", disc.velocity_m_s, start.velocity_m_s[i]),
        ):
            if any(abs(f - a) > relative * abs(a) for a, f in zip(asked, found.tolist(), strict=True)):
                what = f"disc {i} does not start as the scene has it"
                raise Violation(what, expected=f"{field} = {asked}", found=tuple(found.tolist()), setup=setup)
    if start.contacts or start.warning:
        found = start.warning or start.contacts
        raise Violation("a world begins with contacts or a warning", expected="none", found=found, setup=setup)
