"""Conduct: repeatable, unmoved by being looked at, silent, tidy, and letting go of what it holds."""

from __future__ import annotations

import numpy as np

from carom.conformance.checks.common import own_setup
from carom.conformance.checks.settings import UNKNOWN
from carom.conformance.probe import Raised, Watched
from carom.conformance.scenes import approach, crowd
from carom.conformance.subject import Subject
from carom.conformance.violation import NotApplicable, Setup, Violation

__all__ = [
    "closes_after_errors",
    "cutting_leaves_no_trace",
    "is_silent_and_tidy",
    "keeps_what_it_showed",
    "lets_go_of_worlds",
    "looking_changes_nothing",
    "repeats_to_the_bit",
    "steps_singly_or_together",
]

#: An open PyBullet client holds 29 MB and an idle pymunk space 10 kB; 180 worlds that leak 100 kB each leave 18 MB.
WORLDS = 190
LEAK_BYTES = 18_000_000


def repeats_to_the_bit(subject: Subject, profile: str) -> None:
    """Where determinism is declared, a run repeats to the bit, also after worlds with other settings."""
    _require_deterministic(subject)
    setup = own_setup(crowd(), profile)
    first = subject.seen(setup)
    for other in ("default", "tuned"):
        if other != profile:
            subject.watch(own_setup(crowd(), other))
    again = subject.watch(setup)
    _require_same(setup, first, again, "two runs of one scene differ, and determinism is declared")


def looking_changes_nothing(subject: Subject, profile: str) -> None:
    """Observing twice after each step yields the same run as observing once."""
    _require_deterministic(subject)
    setup = own_setup(crowd(), profile)
    _require_same(setup, subject.seen(setup), subject.watch(setup, looks=2), "a second observe() alters the run")


def steps_singly_or_together(subject: Subject, profile: str) -> None:
    """Taking all steps in one call, as when timed, ends in the same bits as stopping after each to look."""
    _require_deterministic(subject)
    setup = own_setup(crowd(), profile)
    watched, at_once = subject.seen(setup).seen[-1], subject.watch(setup, looks=0).seen[-1]
    for field in ("position_m", "velocity_m_s"):
        wanted, found = getattr(watched, field), getattr(at_once, field)
        if wanted.tobytes() != found.tobytes():
            what = "advance(n) does not end where n times advance(1) and observe() end"
            raise Violation(what, expected=f"{field} {wanted.tolist()}", found=found.tolist(), setup=setup)


def cutting_leaves_no_trace(subject: Subject, profile: str) -> None:
    """A step that is tried and taken back, and being asked what touches, leave no trace in what follows."""
    _require_deterministic(subject)
    setup = own_setup(approach(), profile)
    runs = []
    for disturbed in (False, True):
        answer = subject.try_to_cut(setup, disturbed=disturbed)
        if isinstance(answer, Raised):
            what = f"{answer.where}() raises an error, and the profile declares that its steps can be cut"
            found = f"{answer.kind}: {answer.message}"
            raise Violation(what, expected="a CuttableWorld that runs to the end", found=found, setup=setup)
        runs.append(answer)
    _require_same(setup, runs[0], runs[1], "a step that was taken back leaves a trace")
    for step, (plain, disturbed_now) in enumerate(zip(runs[0].seen, runs[1].seen, strict=True)):
        if plain.contacts != disturbed_now.contacts:
            what = f"the contacts of step {step} differ after touching() was asked"
            raise Violation(what, expected=plain.contacts, found=disturbed_now.contacts, setup=setup)


def keeps_what_it_showed(subject: Subject, profile: str) -> None:
    """An observation stays as it was when the world goes on: its arrays are no views of the engine's memory."""
    setup = own_setup(crowd(), profile)
    altered = subject.seen(setup).altered
    if altered is not None:
        what = "an observation is altered by later steps"
        raise Violation(what, expected="arrays of its own", found=f"observation {altered} changed", setup=setup)


def is_silent_and_tidy(subject: Subject) -> None:
    """Starting the engine and running a scene with each profile prints nothing and leaves no file behind."""
    with subject.another() as fresh:
        for profile in subject.adapter.profiles:
            setup = own_setup(crowd(), profile)
            fresh.watch(setup)
        printed, files = fresh.printed().strip(), fresh.files()
    if printed:
        what = "the engine prints"
        raise Violation(what, expected="nothing on stdout or stderr", found=repr(printed[:200]), setup=setup)
    if files:
        what = "the engine leaves files in the working folder"
        raise Violation(what, expected="none", found=", ".join(files), setup=setup)


def closes_after_errors(subject: Subject) -> None:
    """A world closed before its first step, and a refused one, leave an engine that runs as if they had never been."""
    setup = own_setup(crowd(), "tuned")
    clean = subject.seen(setup)
    subject.growth_bytes(setup, 2, step=False)
    subject.try_to_watch(setup, **{UNKNOWN: 1})
    after = subject.watch(setup)
    if subject.capabilities().deterministic:
        _require_same(setup, clean, after, "a run differs after a world that was given up")


def lets_go_of_worlds(subject: Subject) -> None:
    """Two hundred worlds made, stepped and closed one after another leave less behind than one open world would."""
    setup = own_setup(approach(), "tuned")
    grown = subject.growth_bytes(setup, WORLDS)
    if grown is None:
        raise NotApplicable("the resident memory of a process is read from /proc, which is not here")
    if grown > LEAK_BYTES:
        what = "close() does not release what the engine holds"
        expected = f"less than {LEAK_BYTES / 1e6:g} MB left by {WORLDS - 10} worlds"
        raise Violation(what, expected=expected, found=f"{grown / 1e6:.3g} MB", setup=setup)


def _require_deterministic(subject: Subject) -> None:
    if not subject.capabilities().deterministic:
        raise NotApplicable("deterministic is declared to be False")


def _require_same(setup: Setup, wanted: Watched, found: Watched, what: str) -> None:
    if len(wanted.seen) != len(found.seen):
        raise Violation(what, expected=f"{len(wanted.seen)} states", found=f"{len(found.seen)} states", setup=setup)
    for step, (a, b) in enumerate(zip(wanted.seen, found.seen, strict=True)):
        for field in ("position_m", "velocity_m_s"):
            x, y = getattr(a, field), getattr(b, field)
            if x.tobytes() != y.tobytes():
                disc = int(np.argmax(np.any(x != y, axis=1)))
                expected, got = (tuple(part[disc].tolist()) for part in (x, y))
                where = f"{what}: {field} of disc {disc} after step {step}"
                raise Violation(where, expected=expected, found=got, setup=setup)
