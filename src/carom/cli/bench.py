"""`carom bench`: run time against error, from one command, resumable, here or on a cluster."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from carom.bench.axes import Diagram, ErrorKind
from carom.cli import shared
from carom.errors import InputError
from carom.folders import claimed
from carom.limits import MOST_DISCS, MOST_PHASES, MOST_ROUNDS, MOST_SERIES
from carom.text import shortened

if TYPE_CHECKING:
    from carom.bench.bench_plan import BenchPlan
    from carom.runs.pool import Pool

__all__ = ["bench"]


@shared.guarded
def bench(
    scenes: Annotated[list[str] | None, shared.SCENE_NAMES] = None,
    engine: shared.EngineNames = None,
    dt: Annotated[
        list[str] | None,
        typer.Option(
            "--dt",
            help="Step in seconds, such as 1/240, or a geometric series 1/60..1/10000:6 (of six steps); repeatable. "
            "By default six steps from each scene's own frame to one 167 times finer.",
        ),
    ] = None,
    profile: shared.ProfileNames = None,
    out: Annotated[
        Path, typer.Option("--out", "-o", help="Folder for the page, the diagrams, bench.json and the journals.")
    ] = Path("carom-bench"),
    resume: shared.Resume = False,
    retry: shared.Retry = False,
    error: Annotated[ErrorKind, typer.Option("--error", help="Which error stands on the axis.")] = ErrorKind.IMPACT,
    target: Annotated[
        float, typer.Option("--target", help="The error to which the cheapest way is looked for.")
    ] = 1e-3,
    axes: Annotated[list[Diagram] | None, typer.Option("--axes", help="Diagrams, repeatable. All by default.")] = None,
    phases: Annotated[
        int,
        typer.Option(
            "--phases", min=1, max=MOST_PHASES, help="Starts, spread evenly over a step, that each run is scored at."
        ),
    ] = 4,
    rounds: Annotated[int, typer.Option("--rounds", min=3, max=MOST_ROUNDS, help="Rounds of the timing pass.")] = 7,
    seed: Annotated[
        int, typer.Option("--seed", min=0, max=2**63 - 1, help="Of the random order within the rounds.")
    ] = 1,
    budget: Annotated[
        float, typer.Option("--budget", help="Seconds a scene, half for scoring and half for timing.")
    ] = 80.0,
    time_limit: shared.TimeLimit = 60.0,
    memory_limit: shared.MemoryLimit = None,
    jobs: shared.Jobs = None,
    scheduler: Annotated[
        str, typer.Option("--scheduler", help="Score on the Dask cluster of this scheduler, tcp:// or tls://host:port.")
    ] = "",
    timing: Annotated[bool, typer.Option("--timing/--no-timing", help="Whether to time at all.")] = True,
    verbose: shared.Verbose = False,
    grow: Annotated[
        bool,
        typer.Option("--grow", help="Instead: run time and memory against the number of discs, on a gas; no scene."),
    ] = False,
    discs: Annotated[
        list[int] | None,
        typer.Option(
            "--discs", min=1, max=MOST_DISCS, help="With --grow, a number of discs; repeatable. 2 to 10,000 by default."
        ),
    ] = None,
) -> None:
    """Measure error against run time, and say which engine is the cheapest for the accuracy that you need.

    Errors come from a scoring pass; run times from a pass of their own in which nothing is observed and nothing else
    runs. A line of a journal is written for every finished cell: a bench that was ended goes on with --resume.

    Examples: `carom bench my-scene.toml`, `carom bench paper -e pymunk -e mujoco --dt 1/60..1/10000:8 --out mine`,
    `carom bench my-scene.toml --scheduler tcp://10.0.0.1:8786 --resume`.
    """
    if grow:
        limits = (budget, time_limit, memory_limit)
        _grow(scenes or [], engine, profile, discs, out, *limits, resume=resume, retry=retry, verbose=verbose)
        return
    from carom.bench.bench_plan import BenchPlan
    from carom.bench.rounds import timing_journal
    from carom.bench.work_precision import work_precision
    from carom.report.bench_document import bench_document, write_bench
    from carom.report.files import require_report_extra
    from carom.runs.scoring import score_journal

    if not scenes:
        raise InputError("name the scenes to bench, a file or scenes of the catalogue: carom bench my-scene.toml")
    found = shared.plain_scenes_named(scenes)
    plan = BenchPlan(
        engines=tuple(engine) if engine else None,
        dts=tuple(step for text in dt for step in step_series(text)) if dt else None,
        profiles=tuple(profile or ("default", "tuned")),
        phases=phases,
        error=error,
        target=target,
        rounds=rounds,
        seed=seed,
        budget_s=budget,
        time_limit_s=time_limit,
        memory_limit_mb=memory_limit,
        timing=timing,
    )
    require_report_extra()
    scored = out / "journal.jsonl"
    with (
        claimed(out, "bench", "--out"),
        shared.resumable(scored),
        score_journal(scored, resume=resume, retry=retry) as journal,
        timing_journal(out / "timings.jsonl", resume=resume, retry=retry) as timings,
        shared.progress_bar() as progress,
    ):
        result = work_precision(
            found,
            plan,
            _pool(plan, scheduler, jobs),
            notes=journal,
            timings=timings,
            progress=progress,
            command=shared.command_line(),
        )
    page = write_bench(result, out, tuple(axes or Diagram))
    shared.print_document(bench_document(result), full=verbose)
    shared.say_place("page", page)


def step_series(text: str) -> tuple[float, ...]:
    """Read a step such as ``1/240``, or a geometric series such as ``1/60..1/10000:6``."""
    from carom.bench.bench_plan import STEPS, geometric_steps

    if ".." not in text:
        return (shared.seconds(text),)
    ends, _, count = text.partition(":")
    coarsest, _, finest = ends.partition("..")
    if count and not (count.isascii() and count.isdigit() and len(count) < 10 and int(count) <= MOST_SERIES):
        what = f"a series such as 1/60..1/10000:6, of {MOST_SERIES} steps at most"
        raise InputError(f"--dt must be {what}, got {shortened(repr(text))}")
    return geometric_steps(shared.seconds(coarsest), shared.seconds(finest), int(count) if count else STEPS)


def _grow(
    scenes: list[str],
    engine: list[str] | None,
    profile: list[str] | None,
    discs: list[int] | None,
    out: Path,
    budget_s: float,
    time_limit_s: float,
    memory_limit_mb: float | None,
    *,
    resume: bool,
    retry: bool,
    verbose: bool,
) -> None:
    from carom.bench.growth import growth, growth_journal
    from carom.report.files import require_report_extra
    from carom.report.growth_document import growth_document, write_growth

    if scenes:
        raise InputError(f"--grow runs a gas of its own and takes no scene, got {scenes[0]!r}")
    if profile and len(profile) > 1:
        raise InputError(f"--grow runs one profile, got {len(profile)}")
    require_report_extra()
    path = out / "growth.jsonl"
    with (
        claimed(out, "bench", "--out"),
        shared.resumable(path),
        growth_journal(path, resume=resume, retry=retry) as journal,
        shared.progress_bar() as progress,
    ):
        found = growth(
            engine,
            profile=profile[0] if profile else "tuned",
            sizes=discs,
            budget_s=budget_s,
            time_limit_s=time_limit_s,
            memory_limit_mb=memory_limit_mb,
            notes=journal,
            progress=progress,
            command=shared.command_line(),
        )
    page = write_growth(found, out)
    shared.print_document(growth_document(found), full=verbose)
    shared.say_place("page", page)


def _pool(plan: BenchPlan, scheduler: str, jobs: int | None) -> Pool:
    if scheduler:
        from carom.runs.cluster import ClusterPool

        return ClusterPool(scheduler, plan.time_limit_s, plan.memory_limit_mb)
    from carom.runs.pool import LocalPool

    return LocalPool(jobs, plan.time_limit_s, plan.memory_limit_mb)
