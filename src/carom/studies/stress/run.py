"""Execution of `carom stress`: tests every method with every stress test, invariance and reported bug."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache, partial
from itertools import product
from pathlib import Path

from carom.catalogue import BugReport, all_scenes
from carom.errors import UnknownNameError
from carom.execution.describe_engines import describe_engines, select_engines
from carom.execution.environment import describe_environment
from carom.execution.job import Answer, Method, Progress, Status, no_progress
from carom.execution.journal import Journal, JournalEntry
from carom.execution.methods import list_methods, select_profiles
from carom.execution.pool import TaskRunner
from carom.execution.scheduler import DependentTasks, TaskRequest, run_tasks
from carom.studies.stress.bug_reports import check_bug_report
from carom.studies.stress.contact import CONTACT_TESTS, FRICTION_TESTS
from carom.studies.stress.failure_search import find_failure
from carom.studies.stress.invariances import DEVIATION_LIMIT, check_invariance, list_invariances
from carom.studies.stress.many_discs import MANY_DISC_TESTS
from carom.studies.stress.options import StressOptions
from carom.studies.stress.pairs import DT_S, PAIR_TESTS, WALL_TESTS
from carom.studies.stress.result import CellEnding, CellResult, StressResults, StressRow, UnsavedResult
from carom.support.escaping import build_name_hints
from carom.support.folders import claim_while_writing
from carom.support.formatting import capitalise

#: Name of the study in its output folders.
PURPOSE = "stress"

JOURNAL = "journal.jsonl"

#: Identity of a result: kind and name of the test, and the method.
CellKey = tuple[str, str, str]

#: Function that opens the journal of a campaign.
stress_journal = partial(Journal[CellKey, CellResult], "spots", JournalEntry[CellKey, CellResult])

#: Function that computes the result of a test for a method.
FindResult = Callable[[Method, TaskRunner], UnsavedResult]

#: Stress tests, in the order of the table.
STRESS_TESTS = (*PAIR_TESTS, *MANY_DISC_TESTS, *FRICTION_TESTS, *WALL_TESTS, *CONTACT_TESTS)


def list_rows(*, quick: bool = False) -> list[StressRow]:
    """Return all rows of the table: stress tests, invariances and reported bugs."""
    return list(_find_tests(quick))


def run_stress_campaign(
    names: Sequence[str],
    options: StressOptions,
    *,
    out: Path,
    resume: bool = False,
    retry: bool = False,
    progress: Progress = no_progress,
    command: str = "",
) -> StressResults:
    """Run all selected tests with all selected methods, and return the results.

    Args:
        names: Names of stress tests, invariances and reported bugs, or the words "attacks", "relations" and
            "complaints"; all tests if empty.
        options: Options of the campaign.
        out: Folder for the journal and for the scenes that reproduce the numbers.
        resume: Whether to continue from the results in the journal in `out`.
        retry: Whether to repeat runs in which an engine failed.
        progress: Function that is called with the number of finished tests, the number of all tests, and a description.
        command: The command that repeats the campaign, which is stored in the results.

    Raises:
        UnknownNameError: A stress test, engine or profile does not exist.
        InputError: `out` contains files that Carom did not write, the journal of another campaign, or a journal while
            `resume` is false.
    """
    started = time.perf_counter()
    rows = _select_rows(names, options.quick)
    with options.open_pool() as pool:
        infos = select_engines(describe_engines(options.engines, pool), options.engines)
        methods = list_methods(infos, select_profiles(infos, options.profiles), [DT_S], pool)
        columns = [method for info in infos for method in methods.by_engine_and_step[info.name, DT_S]]
        environment = describe_environment(infos)
        stamp = options.stamp | {"carom": environment.carom, "versions": environment.versions}
        asks = []
        for row, method in product(rows, columns):
            known, subject = None, (row.name, method.name)
            if (refused := methods.find_refusal(method, DT_S)) is not None:
                not_run = CellResult(CellEnding.NOT_RUN, reason=refused.problem, status=refused.status)
                known = Answer(Status.RAN, value=not_run)
            task = TableCell(row, method, options.quick, out)
            asks.append(TaskRequest(subject, (row.kind, *subject), task, known))
        cells: dict[tuple[str, str], CellResult] = {}
        with (
            claim_while_writing(out, PURPOSE),
            stress_journal(out / JOURNAL, stamp, resume=resume, retry=retry) as journal,
        ):
            for subject, answer in run_tasks(asks, pool, journal):
                assert answer.value is not None  # noqa: S101 - a test that could not run also has a result
                cells[subject] = answer.value
                progress(len(cells), len(asks), " on ".join(subject))
    elapsed_s = time.perf_counter() - started
    return StressResults(rows, tuple(columns), methods.infos, cells, environment, command, options.quick, elapsed_s)


@dataclass(frozen=True)
class TableCell(DependentTasks[CellResult]):
    """Task that runs a row's test with a method, and saves the scenes of the result into `out`."""

    row: StressRow
    method: Method
    quick: bool
    out: Path

    @property
    def engine(self) -> str:
        """Name of the adapter."""
        return self.method.engine

    def run(self, runner: TaskRunner) -> Answer[UnsavedResult]:
        """Return the result with its scenes."""
        return Answer(Status.RAN, value=_find_tests(self.quick)[self.row](self.method, runner))

    def complete(self, answer: Answer[UnsavedResult]) -> Answer[CellResult]:
        """Save the scenes, and return the result with their file names."""
        assert answer.value is not None  # noqa: S101 - `run` always returns a value
        return Answer(answer.status, value=answer.value.save(self.out))


@cache
def _find_tests(quick: bool) -> dict[StressRow, FindResult]:
    """Return all rows of the table, each with the function that runs its test."""
    tests: dict[StressRow, FindResult] = {}
    for test in STRESS_TESTS:
        if not (quick and test.full_only):
            ladder = tuple(test.build_ladder(quick))
            row = StressRow("attack", test.name, test.axis, test.truth, test.failure_rule, ladder, group=test.group)
            tests[row] = partial(find_failure, test, quick=quick)
    truth = "not needed, because the two runs of the method are compared with each other"
    fails = f"the deviation exceeds {DEVIATION_LIMIT:g}, which is more than rounding errors after three impacts"
    for invariance in list_invariances():
        row = StressRow("relation", invariance.name, invariance.statement, truth, fails)
        tests[row] = partial(check_invariance, invariance)
    for entry in all_scenes().values():
        if isinstance(entry, BugReport):
            tests[_build_bug_report_row(entry)] = partial(check_bug_report, entry)
    return tests


def _build_bug_report_row(bug_report: BugReport) -> StressRow:
    name, truth = bug_report.name.partition("/")[2], bug_report.known.source
    axis = f"{bug_report.about}: {bug_report.summary}"
    threshold = f"errors below {100 * bug_report.smallest_error:g} % do not count"
    fails = capitalise(f"{bug_report.symptom.value}; {threshold}. {bug_report.number_sources}")
    return StressRow("complaint", name, axis, truth, fails, link=bug_report.thread, about=bug_report.engine)


def _select_rows(names: Sequence[str], quick: bool) -> tuple[StressRow, ...]:
    everything = list_rows(quick=quick)
    if not names:
        return tuple(everything)
    kinds = {"attacks": "attack", "relations": "relation", "complaints": "complaint"}
    known = {row.name for row in everything}
    for name in names:
        if name not in known and name not in kinds:
            hints = build_name_hints(name, known, f"`carom stress --list` lists all names; kinds: {', '.join(kinds)}")
            raise UnknownNameError(f"no stress test is named {name!r}", hints=hints)
    requested_kinds = {kinds[name] for name in names if name in kinds}
    return tuple(row for row in everything if row.name in names or row.kind in requested_kinds)
