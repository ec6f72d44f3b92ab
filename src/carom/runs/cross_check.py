"""Running a scene on an engine, and cross-checking many scenes on many engines against PIC."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace

from carom.comparator import Horizon, Score, compare
from carom.comparator.believed import estimate_horizon
from carom.comparator.finite import not_finite
from carom.comparator.shift import Shifted, shifted_scenes
from carom.errors import AdapterError, InputError
from carom.registry import EngineInfo, load_adapter
from carom.runs.certification import CERTIFY_SECONDS, Reference, certified_reference, will_certify
from carom.runs.environment import environment
from carom.runs.execute import Executor
from carom.runs.phases import PhaseSpread, phase_values, spread_of
from carom.runs.plan import chosen_engines, planned_cells
from carom.runs.results import Cell, Results, Row, Status
from carom.scene import Scene
from carom.scenes import CatalogueScene, KnownAnswer, deviation
from carom.solvers.pic import solve_pic
from carom.trace import Outcome, Trace

__all__ = [
    "DEFAULT_TIME_LIMIT_S",
    "MOST_IMPACTS",
    "cross_check",
    "reference_trace",
    "run",
]

DEFAULT_TIME_LIMIT_S = 60.0
#: A minute or so of PIC in plain Python, and of memory for every row: a longer reference is for a solver, not a table.
MOST_IMPACTS = 200_000

#: PIT stands for sampling itself: every method is held against it at its own step.
SAMPLING = ("pit", "tuned")

Progress = Callable[[int, int, str], None]
Key = tuple[str, str, str, float]


def run(
    scene: Scene, engine: str, *, dt: float, profile: str = "tuned", time_limit_s: float = DEFAULT_TIME_LIMIT_S
) -> Trace:
    """Run a scene on an engine, in a process of its own, and return what happened.

    Args:
        scene: The scene.
        engine: Name of an adapter, as `carom.engines()` lists it.
        dt: Step, seconds.
        profile: Name of one of its profiles.
        time_limit_s: The engine is ended after so many seconds.

    Raises:
        UnknownNameError: There is no such engine or profile.
        InputError: `dt` or `time_limit_s` is not a positive number.
        AdapterError: The engine is unavailable, does not support the scene, crashed, or gave no answer in time.
    """
    _require_positive(dt=dt, time_limit_s=time_limit_s)
    load_adapter(engine)
    with Executor(1, time_limit_s) as executor:
        row = executor.observe(Cell(scene, engine, profile, dt), samples=True)
    if row.trace is None:
        where = f"{engine} ({profile}, dt = {dt:g} s) on {scene.name!r}"
        raise AdapterError(f"{where}: {row.status.value}: {row.reason}")
    return row.trace


def cross_check(
    scenes: Iterable[Scene | CatalogueScene],
    engine_names: Sequence[str] | None = None,
    *,
    dts: Sequence[float] | None = None,
    profiles: Sequence[str] | None = None,
    jobs: int | None = None,
    time_limit_s: float = DEFAULT_TIME_LIMIT_S,
    timing: bool = True,
    certified: bool | None = None,
    certify_s: float = CERTIFY_SECONDS,
    phases: int = 0,
    seed: int = 0,
    samples: bool = True,
    progress: Progress | None = None,
    command: str = "",
) -> Results:
    """Run every scene on every engine with every profile at every step, and score each run against PIC.

    Args:
        scenes: Scenes, of one's own or of the catalogue; no two of one name.
        engine_names: Names of adapters; every one that is installed by default.
        dts: Steps, seconds; by default those of `default_dts` for each scene.
        profiles: Names of profiles, or "all"; by default those of `DEFAULT_PROFILES` that there are. Where two profiles
            of an engine have the same settings, only the later one is run. One whose steps are cut is run at a scene's
            coarsest step only, unless steps are asked for, since what it finds does not depend on them.
        jobs: How many cells are observed at a time; as many as there are cores by default.
        time_limit_s: An engine that gives no answer for so long is ended, and its row says so.
        timing: Whether to time each cell at its scene's coarsest step too, in a pass in which nothing else runs.
        certified: Whether to score against certified runs. By default PIC is the reference, and for scenes of three
            discs or more a certified run says up to which impact it may be believed, where python-flint is installed.
        certify_s: Seconds for the certified run of each scene.
        phases: At how many sub-step phases to run each cell beside the scene's own, for the spread of its errors.
        seed: Where the quasi-random sequence of phases begins.
        samples: Whether to keep states for drawing; nobody draws them where no report is written.
        progress: Called with (done, all, what) as cells finish.
        command: The command line to print in the report.

    Raises:
        InputError: No scenes, two scenes of one name, or a number that is not positive.
        UnknownNameError: There is no such engine, or no engine asked for has such a profile.
    """
    started = time.perf_counter()
    if isinstance(phases, bool) or not isinstance(phases, int) or phases < 0:
        raise InputError(f"phases must be a whole number, 0 or more, got {phases!r}")
    if isinstance(scenes, Scene | CatalogueScene) or isinstance(engine_names, str):
        raise InputError("scenes and engine_names must be lists, also where there is one of them")
    _require_positive(
        time_limit_s=time_limit_s, certify_s=certify_s, **{f"dts[{k}]": dt for k, dt in enumerate(dts or ())}
    )
    plain, answers = _sort_out(scenes)
    infos = chosen_engines(engine_names)
    cells = list(planned_cells(plain, infos, dts, profiles))
    solved = {scene.name: reference_trace(scene) for scene in plain}
    held_against: dict[str, Reference] = {}
    pic = {name: trace for name, trace in solved.items() if isinstance(trace, Trace)}
    for name, trace in pic.items():
        if progress is not None and will_certify(trace.scene, certified):
            progress(0, len(cells), f"certifying {name}")
        held_against[name] = certified_reference(trace, certified, certify_s)
    references = {name: reference.trace for name, reference in held_against.items()}
    unscorable = {name: reason for name, reason in solved.items() if isinstance(reason, str)}
    rows: dict[Key, Row] = {
        _key(cell): Row(cell, Status.UNSUPPORTED, unscorable[cell.scene.name])
        for cell in cells
        if cell.scene.name in unscorable
    }
    scorable = [cell for cell in cells if cell.scene.name not in unscorable]
    pit_cells = _sampling_cells(scorable)
    others = [cell for cell in scorable if (cell.engine, cell.profile) != SAMPLING]
    horizons = {name: at for name, reference in held_against.items() if (at := _horizon_s(reference)) is not None}
    timed = sum(cell.refinement == 0 for cell in scorable) if timing else 0
    shifted = _shifted_cells(scorable, references, phase_values(phases, seed))
    done, total = 0, len(pit_cells) + len(others) + timed + sum(map(len, shifted.values()))

    def report(row: Row) -> None:
        nonlocal done
        done += 1
        rows[_key(row.cell)] = row
        if progress is not None:
            progress(done, total, f"{row.cell.scene.name} on {row.cell.engine}")

    def score(row: Row) -> Row:
        reference = references.get(row.cell.scene.name)
        if row.trace is None or reference is None:
            return row
        pit = rows[_key(replace(row.cell, engine=SAMPLING[0], profile=SAMPLING[1]))]
        horizon = horizons.get(row.cell.scene.name)
        return replace(row, score=compare(reference, row.trace, sampling=pit.trace, horizon=horizon))

    def spreads(executor: Executor) -> dict[Key, PhaseSpread]:
        nonlocal done
        ran = {key: entries for key, entries in shifted.items() if rows[key].status is Status.RAN}
        done += sum(map(len, shifted.values())) - sum(map(len, ran.values()))
        home = {id(cell): (key, one) for key, entries in ran.items() for cell, one in entries}
        scores: dict[Key, list[Score]] = {key: [] for key in ran}
        for row in executor.observe_all([cell for entries in ran.values() for cell, _ in entries], samples=False):
            key, one = home[id(row.cell)]
            done += 1
            if progress is not None:
                progress(done, total, f"{key[0]} on {key[1]}, at {phases} phases")
            if row.trace is not None:
                scores[key].append(compare(one.reference, row.trace, horizon=horizons.get(key[0])))
        return {key: spread_of(of, rows[key].cell.scene, rows[key].cell.dt_s) for key, of in scores.items()}

    with Executor(jobs, time_limit_s) as executor:
        for row in executor.observe_all(pit_cells, samples=samples):
            report(row)
        for row in executor.observe_all(others, samples=samples):
            report(score(row))
        spread = spreads(executor)
        for cell in scorable:
            row = rows[_key(cell)] if (cell.engine, cell.profile) != SAMPLING else score(rows[_key(cell)])
            rows[_key(cell)] = row
            if timing and cell.refinement == 0:
                report(executor.time(row))
    return Results(
        rows=_with_ratios([replace(rows[_key(cell)], spread=spread.get(_key(cell))) for cell in cells]),
        references=references,
        known={
            name: (answer, deviation(pic[name], answer, references[name].scene))
            for name, answer in answers.items()
            if name in references
        },
        engines=tuple(infos),
        environment=environment(_versions(infos)),
        command=command,
        elapsed_s=time.perf_counter() - started,
        certified={name: r.certified for name, r in held_against.items() if r.certified is not None},
        horizons=horizons,
        phases=phases,
    )


def _horizon_s(reference: Reference) -> float | None:
    """Return until when a reference may be believed: as certified, or as estimated where it is not; None for all."""
    if reference.horizon_s is not None or isinstance(reference.certified, Horizon):
        return reference.horizon_s
    return estimate_horizon(reference.trace)


def _require_positive(**values: float) -> None:
    for name, value in values.items():
        if not (isinstance(value, int | float) and 0 < value < math.inf):
            raise InputError(f"{name} must be a positive number of seconds, got {value!r}")


def _sort_out(scenes: Iterable[Scene | CatalogueScene]) -> tuple[list[Scene], dict[str, KnownAnswer]]:
    plain: list[Scene] = []
    answers: dict[str, KnownAnswer] = {}
    for entry in scenes:
        if isinstance(entry, CatalogueScene):
            answers[entry.name] = entry.known
            plain.append(entry.scene)
        else:
            plain.append(entry)
    if not plain:
        raise InputError("there is no scene to run")
    names = [scene.name for scene in plain]
    twice = sorted({name for name in names if names.count(name) > 1})
    if twice:
        raise InputError(f"two scenes have the name {twice[0]!r}: a report could not tell them apart")
    return plain, answers


def reference_trace(scene: Scene) -> Trace | str:
    """Return the PIC trace that everything is held against, or why there is none, for every row to say."""
    try:
        trace = solve_pic(scene, max_impacts=MOST_IMPACTS)
    except InputError as error:
        return str(error)
    if trace.outcome is Outcome.MAX_IMPACTS:
        at = f"{MOST_IMPACTS} impacts come before {trace.end_time_s:.6g} s of its {scene.duration_s:g} s"
        return f"{at}, more than a cross-check follows; shorten duration_s"
    if broken := not_finite(trace):
        return f"PIC's own answer is no number: {broken}"
    return trace


def _sampling_cells(cells: Sequence[Cell]) -> list[Cell]:
    """PIT on each scene at each step that is run, asked for or not: what sampling alone costs there."""
    engine, profile = SAMPLING
    return list({(c.scene.name, c.dt_s): replace(c, engine=engine, profile=profile) for c in cells}.values())


def _shifted_cells(
    cells: Sequence[Cell], references: Mapping[str, Trace], phases: Sequence[float]
) -> dict[Key, list[tuple[Cell, Shifted]]]:
    """Return for each cell those of its phases: the cell with its scene shifted, and what it is held against."""
    found: dict[Key, list[tuple[Cell, Shifted]]] = {}
    shifted: dict[tuple[str, float], tuple[Shifted, ...]] = {}
    for cell in cells if phases else ():
        step = (cell.scene.name, cell.dt_s)
        if step not in shifted:
            shifted[step] = shifted_scenes(references[cell.scene.name], cell.dt_s, phases)
        found[_key(cell)] = [(replace(cell, scene=one.scene), one) for one in shifted[step]]
    return found


def _versions(infos: Sequence[EngineInfo]) -> dict[str, str]:
    """Versions of the engines; Carom's own stands in the environment already."""
    return {info.engine: info.version for info in infos if info.available and info.engine != "Carom"}


def _key(cell: Cell) -> Key:
    """Return what tells a cell from the others of a cross-check, in which no two scenes have one name."""
    return (cell.scene.name, cell.engine, cell.profile, cell.dt_s)


def _with_ratios(rows: Sequence[Row]) -> tuple[Row, ...]:
    pit = {
        (row.cell.scene.name, row.cell.dt_s): row.timing.advance_s
        for row in rows
        if row.cell.engine == "pit" and row.timing is not None
    }
    return tuple(
        replace(row, time_ratio=row.timing.advance_s / pit[key])
        if row.timing is not None and (key := (row.cell.scene.name, row.cell.dt_s)) in pit
        else row
        for row in rows
    )
