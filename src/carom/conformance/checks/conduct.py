"""Checks of conduct: repeatable, independent of observations, silent, without leftovers or leaks."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from carom.conformance.adapter_under_test import Subject
from carom.conformance.checks.common import declared
from carom.conformance.checks.settings import UNKNOWN
from carom.conformance.probes import Raised
from carom.conformance.suite_scenes import approach, crowd
from carom.conformance.violation import NotApplicable, Setup, Violation, require
from carom.engines.api import Observation
from carom.support.formatting import number

#: An idle pymunk space, the smallest world, takes 10 kB, so 180 unreleased ones leak 1.8 MB.
WORLDS = 190
LEAK_BYTES = 1_800_000
#: A leak grows in every round; memory that grows once or is collected late does not. Node comes to rest within five.
ROUNDS = 10


def repeats_to_the_bit(subject: Subject, profile: str) -> None:
    """If determinism is declared, a repeated run is bit-identical, also after worlds with other settings."""
    declared(subject, "deterministic")
    setup = Setup(crowd(), profile)
    first = subject.seen(setup).seen
    for other in ("default", "tuned"):
        if other != profile:
            subject.watch(Setup(crowd(), other))
    again = subject.watch(setup).seen
    _require_same(setup, first, again, "two runs of one scene differ, and determinism is declared")


def looking_changes_nothing(subject: Subject, profile: str) -> None:
    """Observing twice after each step yields the same run as observing once."""
    declared(subject, "deterministic")
    setup = Setup(crowd(), profile)
    once, twice = subject.seen(setup).seen, subject.watch(setup, looks=2).seen
    _require_same(setup, once, twice, "a second observe() alters the run")


def steps_singly_or_together(subject: Subject, profile: str) -> None:
    """All steps in one call, as in timing, end with the same bits as single observed steps."""
    declared(subject, "deterministic")
    setup = Setup(crowd(), profile)
    watched, at_once = subject.seen(setup).seen[-1], subject.watch(setup, looks=0).seen[-1]
    for field in ("position_m", "velocity_m_s"):
        wanted, found = getattr(watched, field), getattr(at_once, field)
        what = "advance(n) does not end where n times advance(1) and observe() end"
        same = wanted.tobytes() == found.tobytes()
        require(same, what, f"{field} {wanted.tolist()}", found.tolist(), setup)


def cutting_leaves_no_trace(subject: Subject, profile: str) -> None:
    """A step that is tried and undone, and queries of contacts, do not change the run."""
    declared(subject, "deterministic")
    setup = Setup(approach(), profile)
    runs = []
    for disturbed in (False, True):
        answer = subject.try_to_watch(setup, cut=True, disturbed=disturbed)
        if isinstance(answer, Raised):
            what = f"{answer.where}() raises an error, and the profile declares that its steps can be cut"
            found = f"{answer.kind}: {answer.message}"
            raise Violation(what, expected="a CuttableWorld that runs to the end", found=found, setup=setup)
        runs.append(answer.seen)
    whole, disturbed_run = runs
    _require_same(setup, whole, disturbed_run, "a step that was taken back leaves a trace")
    for step, (plain, cut) in enumerate(zip(whole, disturbed_run, strict=True)):
        what = f"the contacts of step {step} differ after touching() was asked"
        require(plain.contacts == cut.contacts, what, plain.contacts, cut.contacts, setup)


def keeps_what_it_showed(subject: Subject, profile: str) -> None:
    """Later steps do not change an observation, so its arrays are no views of the engine's memory."""
    setup = Setup(crowd(), profile)
    altered = subject.seen(setup).altered
    what, found = "an observation is altered by later steps", f"observation {altered} changed"
    require(altered is None, what, "arrays of its own", found, setup)


def is_silent_and_tidy(subject: Subject) -> None:
    """Starting the engine and running a scene with each profile prints nothing and leaves no file."""
    with subject.another() as fresh:
        for profile in subject.adapter.profiles:
            setup = Setup(crowd(), profile)
            fresh.watch(setup)
        printed, files = fresh.printed().strip(), fresh.files()
    require(not printed, "the engine prints", "nothing on stdout or stderr", repr(printed[:200]), setup)
    require(not files, "the engine leaves files in the working folder", "none", ", ".join(files), setup)


def closes_after_errors(subject: Subject) -> None:
    """A world closed before its first step, and a refused one, do not change later runs."""
    setup = Setup(crowd())
    clean = subject.seen(setup).seen
    subject.growth_bytes(setup, 2, step=False)
    subject.try_to_watch(setup, {UNKNOWN: 1})
    after = subject.watch(setup).seen
    if subject.capabilities().deterministic:
        _require_same(setup, clean, after, "a run differs after a world that was given up")


def lets_go_of_worlds(subject: Subject) -> None:
    """200 worlds that are made, stepped and closed leak less memory than as many small ones take."""
    setup, least = Setup(approach()), math.inf
    for _ in range(ROUNDS):
        grown = subject.growth_bytes(setup, WORLDS)
        if grown is None:
            raise NotApplicable("the resident memory of a process is read from /proc, which is not here")
        least = min(least, grown)
        if least < LEAK_BYTES:
            return
    expected = f"less than {LEAK_BYTES / 1e6:g} MB left by {WORLDS - 10} worlds, once in {ROUNDS} rounds"
    raise Violation(
        "close() does not release what the engine holds",
        expected=expected,
        found=f"at least {number(least / 1e6, 3)} MB, in each of them",
        setup=setup,
    )


def _require_same(setup: Setup, wanted: Sequence[Observation], found: Sequence[Observation], what: str) -> None:
    require(len(wanted) == len(found), what, f"{len(wanted)} states", f"{len(found)} states", setup)
    for step, (a, b) in enumerate(zip(wanted, found, strict=True)):
        for field in ("position_m", "velocity_m_s"):
            x, y = getattr(a, field), getattr(b, field)
            if x.tobytes() != y.tobytes():
                disc = int(np.argmax(np.any(x != y, axis=1)))
                expected, got = (tuple(part[disc].tolist()) for part in (x, y))
                where = f"{what}: {field} of disc {disc} after step {step}"
                raise Violation(where, expected=expected, found=got, setup=setup)
