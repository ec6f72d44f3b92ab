"""Checks of side effects: runs are repeatable, observing changes nothing, and nothing is printed or leaked."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from carom.conformance.adapter_under_test import Subject
from carom.conformance.checks.common import require_declared
from carom.conformance.checks.settings import UNKNOWN
from carom.conformance.probes import AdapterFailure
from carom.conformance.suite_scenes import build_approach, build_crowd
from carom.conformance.violation import NotApplicable, Setup, Violation, require
from carom.engines.api import Observation
from carom.support.formatting import format_number

#: Number of worlds in each round of the check for memory leaks. While the first ten worlds of a round run, the engine
#: allocates memory for reuse. The smallest world of any engine takes 10 kB, so 180 worlds that are not released leak
#: 1.8 MB.
WORLDS = 190
LEAK_BYTES = 1_800_000
#: Number of rounds of the check for memory leaks. A leak grows in every round. Cached memory grows only in the first
#: rounds: in up to five rounds with engines that run in Node.
ROUNDS = 10


def check_determinism(subject: Subject, profile: str) -> None:
    """If the adapter declares determinism, a repeated run is bit-identical, even after runs with other settings."""
    require_declared(subject, "deterministic")
    setup = Setup(build_crowd(), profile)
    first = subject.watch_cached(setup).states
    for other in ("default", "tuned"):
        if other != profile:
            subject.watch(Setup(build_crowd(), other))
    second = subject.watch(setup).states
    _require_same(setup, first, second, "two runs of one scene differ, although determinism is declared")


def check_observing(subject: Subject, profile: str) -> None:
    """A run does not depend on whether it is observed once or twice after each step."""
    require_declared(subject, "deterministic")
    setup = Setup(build_crowd(), profile)
    observed_once, observed_twice = subject.watch_cached(setup).states, subject.watch(setup, observations=2).states
    _require_same(setup, observed_once, observed_twice, "a second observe() changes the run")


def check_steps_together(subject: Subject, profile: str) -> None:
    """All steps in one call, as in timed runs, give exactly the same state as single steps with observations."""
    require_declared(subject, "deterministic")
    setup = Setup(build_crowd(), profile)
    watched, at_once = subject.watch_cached(setup).states, subject.watch(setup, observations=0).states
    problem = "advance(n) gives another state than n calls of advance(1) and observe()"
    _require_same(setup, [watched[0], watched[-1]], at_once, problem)


def check_cutting(subject: Subject, profile: str) -> None:
    """A run does not change if a step is made and undone, or if the touching bodies are queried."""
    require_declared(subject, "deterministic")
    setup = Setup(build_approach(), profile)
    runs = []
    for disturbed in (False, True):
        answer = subject.try_to_watch(setup, cut=True, disturbed=disturbed)
        if isinstance(answer, AdapterFailure):
            problem = f"{answer.where}() raises an error, although the profile declares that its steps can be cut"
            raise Violation(problem, "a CuttableWorld that runs to the end", answer.cause, setup)
        runs.append(answer.states)
    plain_run, disturbed_run = runs
    _require_same(setup, plain_run, disturbed_run, "a step that was undone changes the run")
    for step, (plain, cut) in enumerate(zip(plain_run, disturbed_run, strict=True)):
        problem = f"the contacts of step {step} differ after touching() was called"
        require(plain.contacts == cut.contacts, problem, plain.contacts, cut.contacts, setup)


def check_observations_stay(subject: Subject, profile: str) -> None:
    """Later steps do not change an observation, so its arrays must not be views of the engine's memory."""
    setup = Setup(build_crowd(), profile)
    altered = subject.watch_cached(setup).overwritten_state
    problem, found = "later steps change an observation", f"observation {altered} changed"
    require(altered is None, problem, "arrays that only the observation uses", found, setup)


def check_silent_and_tidy(subject: Subject) -> None:
    """The engine prints nothing and leaves no files when it runs a scene with each profile."""
    with subject.create_fresh_copy() as fresh:
        for profile in subject.adapter.profiles:
            setup = Setup(build_crowd(), profile)
            fresh.watch(setup)
        printed, files = fresh.worker.read_output().strip(), fresh.worker.list_files()
    require(not printed, "the engine prints", "nothing on stdout or stderr", repr(printed[:200]), setup)
    require(not files, "the engine leaves files in the working folder", "none", ", ".join(files), setup)


def check_closes_after_errors(subject: Subject) -> None:
    """A world that was closed before its first step, or a scene that was refused, does not change later runs."""
    setup = Setup(build_crowd())
    clean = subject.watch_cached(setup).states
    subject.measure_growth(setup, 2, step=False)
    subject.try_to_watch(setup, {UNKNOWN: 1})
    after = subject.watch(setup).states
    if subject.capabilities().deterministic:
        _require_same(setup, clean, after, "a run differs after a world that was not completed")


def check_lets_go_of_worlds(subject: Subject) -> None:
    """Closing a world releases its memory."""
    setup, least_growth = Setup(build_approach()), math.inf
    for _ in range(ROUNDS):
        grown = subject.measure_growth(setup, WORLDS)
        if math.isnan(grown):
            raise NotApplicable("this system has no /proc, from which the memory of a process is read")
        least_growth = min(least_growth, grown)
        if least_growth < LEAK_BYTES:
            return
    expected = f"{WORLDS - 10} worlds to leave less than {LEAK_BYTES / 1e6:g} MB in at least one of {ROUNDS} rounds"
    problem = "close() does not release the engine's memory"
    raise Violation(problem, expected, f"at least {format_number(least_growth / 1e6, 3)} MB in every round", setup)


def _require_same(setup: Setup, reference: Sequence[Observation], found: Sequence[Observation], problem: str) -> None:
    require(len(reference) == len(found), problem, f"{len(reference)} states", f"{len(found)} states", setup)
    for k, (a, b) in enumerate(zip(reference, found, strict=True)):
        for field in ("position_m", "velocity_m_s"):
            x, y = getattr(a, field), getattr(b, field)
            if x.tobytes() != y.tobytes():
                disc = int(np.argmax(np.any(x != y, axis=1)))
                expected, got = (tuple(part[disc].tolist()) for part in (x, y))
                message = f"{problem}: {field} of disc {disc} in observation {k}"
                raise Violation(message, expected, got, setup)
