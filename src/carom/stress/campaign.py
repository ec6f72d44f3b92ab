"""A campaign: every attack, relation and complaint on every method, with progress, a journal and a clean end."""

from __future__ import annotations

import os
import queue
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from functools import cache, partial
from pathlib import Path

from carom.errors import InputError, UnknownNameError
from carom.runs.environment import environment
from carom.runs.execute import Executor
from carom.scenes import Complaint, all_scenes
from carom.stress.attack import Attack
from carom.stress.breaking import Observe, breaking_point
from carom.stress.complaints import complaint_spot
from carom.stress.crowds import crowd_attacks
from carom.stress.journal import Journal
from carom.stress.methods import Method, methods
from carom.stress.own import Check, checks, own_spot
from carom.stress.pairs import RATE_HZ, pair_attacks
from carom.stress.relations import HOLDS, RUNS, relation_spot, relations
from carom.stress.results import Ending, Line, Spot, StressResults

__all__ = ["JOURNAL", "SCENES", "attacks", "listing", "stress"]

JOURNAL = "journal.jsonl"
SCENES = "scenes"

#: An engine that gives no answer for so long has given way. In the quick form no scene takes a second.
TIME_LIMIT_S, QUICK_TIME_LIMIT_S = 60.0, 10.0

Progress = Callable[[int, int, str], None]
Task = tuple[Line, Callable[[Method, Observe], Spot]]


def attacks() -> list[Attack]:
    """Return all attacks, in the order of the table."""
    # Every method is tried at much the same values, and the true answer costs more than a run.
    return [replace(attack, trials=cache(attack.trials)) for attack in (*pair_attacks(), *crowd_attacks())]


def listing(*, quick: bool = False) -> list[Line]:
    """Return every line of the table: attacks, relations, complaints."""
    return [line for line, _ in _all_tasks(Path(SCENES), quick)]


def stress(
    names: Sequence[str] = (),
    engine_names: Sequence[str] | None = None,
    *,
    out: Path,
    profiles: Sequence[str] = ("default", "tuned"),
    quick: bool = False,
    resume: bool = False,
    jobs: int | None = None,
    time_limit_s: float | None = None,
    progress: Progress | None = None,
    command: str = "",
) -> StressResults:
    """Attack methods and return where each gives way.

    Args:
        names: Attacks, relations, checks of our own and complaints by name, or the words "attacks", "relations", "own"
            and "complaints"; all by default.
        engine_names: Names of adapters; every one that is installed by default.
        out: Folder for the journal and for the scenes that reproduce the numbers.
        profiles: Names of profiles.
        quick: The quick form: fewer rungs, nearer ends, a coarser bisection.
        resume: Take up what a journal in `out` says is finished.
        jobs: Cells at a time; as many as there are cores by default.
        time_limit_s: An engine that gives no answer for so long has given way.
        progress: Called with (done, all, what) as cells finish.
        command: The command that makes this again, for the results.

    Raises:
        UnknownNameError: There is no such attack, engine or profile.
        InputError: `out` holds a journal or scenes already and `resume` is not set, or its journal is of another
            campaign.
    """
    started = time.perf_counter()
    limit = time_limit_s or (QUICK_TIME_LIMIT_S if quick else TIME_LIMIT_S)
    scenes = out / SCENES
    tasks = _chosen(names, scenes, quick)
    columns = methods(engine_names, profiles, 1.0 / RATE_HZ)
    versions = {method.engine: method.version for method in columns if method.version}
    here = environment(versions)
    stamp = {"quick": quick, "carom": here.carom, "versions": versions, "time_limit_s": limit}
    with Journal(out / JOURNAL, stamp, resume=resume) as journal:
        if not resume and scenes.exists() and any(scenes.iterdir()):
            raise InputError(f"{scenes} holds files already: name another --out, or go on with a campaign by --resume")
        todo = [
            (task, method)
            for task in tasks
            for method in columns
            if (task[0].kind, task[0].name, method.name) not in journal.spots
        ]
        total = len(tasks) * len(columns)
        done = total - len(todo)
        for spot in _carry_out(todo, jobs, limit):
            journal.add(spot)
            done += 1
            if progress is not None:
                progress(done, total, f"{spot.line} on {spot.method}")
        spots = {
            (line.name, method.name): journal.spots[line.kind, line.name, method.name]
            for line, _ in tasks
            for method in columns
        }
    return StressResults(
        lines=tuple(line for line, _ in tasks),
        methods=tuple(columns),
        spots=spots,
        environment=here,
        command=command,
        quick=quick,
        elapsed_s=time.perf_counter() - started,
    )


def _carry_out(todo: Sequence[tuple[Task, Method]], jobs: int | None, limit_s: float) -> Iterator[Spot]:
    """Carry out cells, several at a time, and yield each as it finishes.

    A worker process takes a second or two to start and import its engine, so the cells of one engine go down as few
    lanes as keep every job busy.
    """
    jobs = jobs or os.cpu_count() or 1
    by_engine: dict[str, list[tuple[Task, Method]]] = {}
    for task, method in todo:
        by_engine.setdefault(method.engine, []).append((task, method))
    lanes_each = max(1, jobs // max(1, len(by_engine)))
    lanes = [cells[k::lanes_each] for cells in by_engine.values() for k in range(lanes_each)]
    finished: queue.SimpleQueue[Spot | BaseException] = queue.SimpleQueue()
    stopped = threading.Event()

    def go_down(lane: Sequence[tuple[Task, Method]], observe: Observe) -> None:
        try:
            for task, method in lane:
                if stopped.is_set():
                    return
                finished.put(_spot(task, method, observe))
        except BaseException as error:  # noqa: BLE001 - it is raised again in the thread that waits
            finished.put(error)

    with Executor(jobs, limit_s) as executor:
        pool = ThreadPoolExecutor(max_workers=jobs)
        try:
            for lane in lanes:
                pool.submit(go_down, lane, partial(executor.observe, samples=False))
            for _ in todo:
                spot = finished.get()
                if isinstance(spot, BaseException):
                    raise spot
                yield spot
        finally:
            stopped.set()
            pool.shutdown(wait=False, cancel_futures=True)


def _spot(task: Task, method: Method, observe: Observe) -> Spot:
    line, carry_out = task
    if method.unavailable:
        return Spot(line.kind, line.name, method.name, Ending.NOT_RUN, reason=f"unavailable: {method.unavailable}")
    return carry_out(method, observe)


def _all_tasks(scenes: Path, quick: bool) -> list[Task]:
    tasks: list[Task] = []
    for attack in attacks():
        if quick and attack.full_only:
            continue
        ladder = attack.ladder(quick)
        line = Line("attack", attack.name, attack.axis, attack.truth, attack.gives_way, (ladder[0], ladder[-1]))
        tasks.append((line, _attack_task(attack, scenes, quick)))
    stated = {relation.name: relation.states for relation in relations()} | RUNS
    truth = "none is needed: the two runs of the method are held against each other"
    fails = f"a deviation above {HOLDS:g}: rounding multiplied by three impacts stays below that"
    tasks += [
        (Line("relation", name, states, truth, fails), partial(_relation, name, scenes))
        for name, states in stated.items()
    ]
    tasks += [
        (
            Line("own", check.name, check.states, "conservation, or the closed form", check.measure),
            partial(_own, check, scenes, quick),
        )
        for check in checks(quick)
    ]
    tasks += [
        (_complaint_line(entry), partial(_complaint, entry, scenes))
        for entry in all_scenes().values()
        if isinstance(entry, Complaint)
    ]
    return tasks


def _own(check: Check, scenes: Path, quick: bool, method: Method, _observe: Observe) -> Spot:
    return own_spot(check, method, scenes, quick=quick)


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


def _complaint(entry: Complaint, scenes: Path, method: Method, observe: Observe) -> Spot:
    return complaint_spot(entry, method, observe, scenes)


def _relation(name: str, scenes: Path, method: Method, observe: Observe) -> Spot:
    return relation_spot(name, method, observe, scenes)


def _attack_task(attack: Attack, scenes: Path, quick: bool) -> Callable[[Method, Observe], Spot]:
    return lambda method, observe: breaking_point(attack, method, observe, scenes, quick=quick)


def _chosen(names: Sequence[str], scenes: Path, quick: bool) -> list[Task]:
    everything = _all_tasks(scenes, quick)
    if not names:
        return everything
    kinds = {"attacks": "attack", "relations": "relation", "own": "own", "complaints": "complaint"}
    known = {line.name for line, _ in everything}
    for name in names:
        if name not in known and name not in kinds:
            raise UnknownNameError(
                f"no attack is named {name!r}; there are: {', '.join(sorted(known))}; and {', '.join(kinds)}"
            )
    wanted = {kinds[name] for name in names if name in kinds}
    return [task for task in everything if task[0].name in names or task[0].kind in wanted]
