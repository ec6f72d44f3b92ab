"""Settings: read back as asked for, and refused where they would be without effect; and the start as written."""

from __future__ import annotations

from carom.adapter.checks import MANTISSA_BITS
from carom.conformance.probe import Raised
from carom.conformance.subject import Subject
from carom.conformance.suite_scenes import crowd
from carom.conformance.violation import Setup, Violation, require

__all__ = ["refuses_unknown_setting", "settings_are_read_back", "starts_as_written"]

UNKNOWN = "carom_no_such_setting"


def settings_are_read_back(subject: Subject, profile: str) -> None:
    """A world reports every setting of its profile, with the value that was asked for."""
    setup = Setup(crowd(), profile)
    used = subject.seen(setup).settings
    for name, value in subject.settings(profile, setup.dt_s).items():
        there = name in used
        found = f"{name} = {used[name]!r}" if there else f"no {name}, but {', '.join(used)}"
        what = "a setting is not the one asked for"
        require(there and used[name] == value, what, f"{name} = {value!r}", found, setup)


def refuses_unknown_setting(subject: Subject) -> None:
    """A setting that would be without effect is an AdapterError that names it."""
    setup = Setup(crowd())
    answer = subject.try_to_watch(setup, {UNKNOWN: 1})
    what, expected = "a setting that does not exist is", f"prepare() to raise an AdapterError naming {UNKNOWN!r}"
    if not isinstance(answer, Raised):
        raise Violation(f"{what} accepted", expected=expected, found="a run to the end of the scene", setup=setup)
    clear = answer.where == "prepare" and answer.deliberate and UNKNOWN in answer.message
    require(clear, f"{what} refused unclearly", expected, answer, setup)


def starts_as_written(subject: Subject, profile: str) -> None:
    """Before its first step a world is in the scene's start state, to the declared width of numbers, untouched."""
    setup = Setup(crowd(), profile)
    start = subject.seen(setup).seen[0]
    # The nearest number of the declared width is all that can be asked for, and no less can.
    relative = 2.0 ** -(MANTISSA_BITS[subject.capabilities().float_bits] + 1)
    for i, disc in enumerate(setup.scene.discs):
        for field in ("position_m", "velocity_m_s"):
            asked, found = getattr(disc, field), tuple(getattr(start, field)[i].tolist())
            same = all(abs(f - a) <= relative * abs(a) for a, f in zip(asked, found, strict=True))
            require(same, f"disc {i} does not start as the scene has it", f"{field} = {asked}", found, setup)
    untouched = not (start.contacts or start.warning)
    require(untouched, "a world begins with contacts or a warning", "none", start.warning or start.contacts, setup)
