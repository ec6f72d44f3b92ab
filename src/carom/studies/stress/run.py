"""A campaign: every attack, relation and complaint on every method, with progress, a journal and a clean end."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, replace
from functools import cache, partial
from pathlib import Path
from typing import Any

from carom.catalogue import Complaint, all_scenes
from carom.errors import UnknownNameError
from carom.execution.engines import describe_engines, list_methods, select_engines
from carom.execution.environment import environment
from carom.execution.job import Answer, Method, Progress, Status, no_progress
from carom.execution.journal import Journal, JournalEntry
from carom.execution.plan import select_profiles
from carom.execution.pool import TaskRunner
from carom.execution.scheduler import DependentTasks, TaskRequest, run_tasks
from carom.studies.stress.attack import Attack
from carom.studies.stress.breaking import breaking_point
from carom.studies.stress.bug_reports import complaint_spot
from carom.studies.stress.contact import contact_attacks
from carom.studies.stress.crowds import crowd_attacks
from carom.studies.stress.failure_points import Line, Spot, SpotEnding, StressResults
from carom.studies.stress.finite_walls import wall_attacks
from carom.studies.stress.friction import rough_attacks
from carom.studies.stress.options import StressOptions
from carom.studies.stress.pairs import RATE_HZ, pair_attacks
from carom.studies.stress.relations import HOLDS, relation_spot, relations
from carom.support.escaping import named_hints
from carom.support.folders import claimed

#: Purpose of a campaign's folder.
PURPOSE = "stress"

JOURNAL = "journal.jsonl"
SCENES = "scenes"

#: The step of all runs.
DT_S = 1.0 / RATE_HZ

#: Identity of a cell: kind and name of its line, and its method.
SpotKey = tuple[str, str, str]

#: Opens the journal of a campaign.
stress_journal = partial(Journal[SpotKey, Spot], "spots", JournalEntry[SpotKey, Spot])

#: A line of the table, and the function that finds its spot for a method.
StressTask = tuple[Line, Callable[[Method, TaskRunner], Spot]]


#: Groups of attacks, by the situation.
GROUPS = {
    "pairs": pair_attacks,
    "crowds": crowd_attacks,
    "friction": rough_attacks,
    "walls": wall_attacks,
    "contact": contact_attacks,
}
#: Attacks with moving walls.
DRIVEN = ("paddle", "legs")


def attacks() -> list[tuple[str, Attack]]:
    """Return all attacks with their groups, in the order of the table."""
    # All methods are tried at similar values, and the true answer costs more than a run.
    return [
        ("driven" if attack.name in DRIVEN else group, replace(attack, trials=cache(attack.trials)))
        for group, of_group in GROUPS.items()
        for attack in of_group()
    ]


def listing(*, quick: bool = False) -> list[Line]:
    """Return every line of the table: attacks, relations, complaints."""
    return [line for line, _ in _all_tasks(Path(SCENES), quick)]


def stress(
    names: Sequence[str],
    asked: StressOptions,
    *,
    out: Path,
    resume: bool = False,
    retry: bool = False,
    progress: Progress = no_progress,
    command: str = "",
) -> StressResults:
    """Attack methods, and return where each fails.

    Args:
        names: Attacks, relations and complaints by name, or the words "attacks", "relations" and "complaints"; all by
            default.
        asked: Options of the campaign.
        out: Folder for the journal and for the scenes that reproduce the numbers.
        resume: Continue from what a journal in `out` says is finished.
        retry: Repeat runs that an engine broke off.
        progress: Called with (done, all, what) as cells finish.
        command: The command that repeats the campaign, for the results.

    Raises:
        UnknownNameError: There is no such attack, engine or profile.
        InputError: `out` holds files of others, or a journal and `resume` is not set, or its journal belongs to another
            campaign.
    """
    started = time.perf_counter()
    scenes = out / SCENES
    tasks = _chosen(names, scenes, asked.quick)
    with asked.pool() as pool, ExitStack() as held:
        infos = select_engines(describe_engines(asked.engines, pool), asked.engines)
        methods = list_methods(infos, select_profiles(infos, asked.profiles), [DT_S], pool)
        columns = [method for info in infos for method in methods.at[info.name, DT_S]]
        here = environment(infos)
        stamp = asked.stamp | {"carom": here.carom, "versions": here.versions}
        asks = [_ask(task, method, methods.find_refusal(method, DT_S)) for task in tasks for method in columns]
        held.enter_context(claimed(out, PURPOSE))
        journal = held.enter_context(stress_journal(out / JOURNAL, stamp, resume=resume, retry=retry))
        spots: dict[tuple[str, str], Spot] = {}
        for subject, answer in run_tasks(asks, pool, journal):
            assert answer.value is not None  # noqa: S101 - a cell that could not be run has a spot that says so
            spots[subject] = answer.value
            progress(len(spots), len(asks), " on ".join(subject))
    lines = tuple(line for line, _ in tasks)
    elapsed_s = time.perf_counter() - started
    return StressResults(lines, tuple(columns), methods.infos, spots, here, command, asked.quick, elapsed_s)


@dataclass(frozen=True)
class TableCell(DependentTasks[Spot]):
    """Find the spot of a line of the table for a method."""

    carry_out: Callable[[Method, TaskRunner], Spot]
    method: Method

    @property
    def engine(self) -> str:
        """Name of the adapter."""
        return self.method.engine

    def run(self, runner: TaskRunner) -> Answer[Spot]:
        """Return the spot."""
        return Answer(Status.RAN, value=self.carry_out(self.method, runner))


def _ask(task: StressTask, method: Method, refused: Answer[Any] | None) -> TaskRequest[tuple[str, str], SpotKey, Spot]:
    (line, carry_out), known = task, None
    if refused is not None:
        ended = SpotEnding.NOT_RUN
        spot = Spot(line.kind, line.name, method.name, ended, reason=refused.said, status=refused.status)
        known = Answer(Status.RAN, value=spot)
    subject = (line.name, method.name)
    return TaskRequest(subject, (line.kind, *subject), TableCell(carry_out, method), known)


def _all_tasks(scenes: Path, quick: bool) -> list[StressTask]:
    tasks: list[StressTask] = []
    for group, attack in attacks():
        if quick and attack.full_only:
            continue
        ladder = tuple(attack.ladder(quick))
        line = Line("attack", attack.name, attack.axis, attack.truth, attack.gives_way, ladder, group=group)
        tasks.append((line, partial(breaking_point, attack, scenes=scenes, quick=quick)))
    truth = "none is needed: the two runs of the method are compared with each other"
    fails = f"a deviation above {HOLDS:g}: rounding multiplied by three impacts stays below that"
    tasks += [
        (
            Line("relation", relation.name, relation.states, truth, fails),
            partial(relation_spot, relation, scenes=scenes),
        )
        for relation in relations()
    ]
    tasks += [
        (_complaint_line(entry), partial(complaint_spot, entry, scenes=scenes))
        for entry in all_scenes().values()
        if isinstance(entry, Complaint)
    ]
    return tasks


def _complaint_line(entry: Complaint) -> Line:
    seen = f"{entry.symptom.value}; an error counts from {100 * entry.at_least:g} % on. {entry.made}"
    return Line(
        "complaint",
        entry.name.partition("/")[2],
        f"{entry.about}: {entry.reported}",
        entry.known.source,
        seen[0].upper() + seen[1:],
        link=entry.thread,
        about=entry.engine,
    )


def _chosen(names: Sequence[str], scenes: Path, quick: bool) -> list[StressTask]:
    everything = _all_tasks(scenes, quick)
    if not names:
        return everything
    kinds = {"attacks": "attack", "relations": "relation", "complaints": "complaint"}
    known = {line.name for line, _ in everything}
    for name in names:
        if name not in known and name not in kinds:
            raise UnknownNameError(
                f"no stress test is named {name!r}",
                hints=named_hints(name, known, f"there are: {', '.join(sorted(known))}; and {', '.join(kinds)}"),
            )
    wanted = {kinds[name] for name in names if name in kinds}
    return [task for task in everything if task[0].name in names or task[0].kind in wanted]
