"""`carom bench`: measure error against run time."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from carom.cli import arguments, error_handling, output
from carom.cli.command_line import get_command_line
from carom.cli.exit_codes import ExitCode
from carom.cli.options import add_options
from carom.errors import InputError
from carom.studies.bench.options import BenchPlan, Diagram


@add_options(BenchPlan)
def bench(
    plan: BenchPlan,
    scenes: Annotated[list[str] | None, arguments.SCENE_NAMES] = None,
    out: Annotated[Path, arguments.declare_out_option("Output folder (default: carom-bench).")] = Path("carom-bench"),
    resume: arguments.Resume = False,
    retry: arguments.Retry = False,
    axes: Annotated[
        list[Diagram] | None, typer.Option("--axes", help="Diagram to draw, repeatable (default: all).")
    ] = None,
    baseline: Annotated[
        Path | None,
        typer.Option(
            "--baseline",
            help="Compare with an earlier bench on this machine (folder or bench.json). Exit code 1 if a run time "
            "or an error became worse.",
        ),
    ] = None,
    verbose: arguments.Verbose = False,
    grow: Annotated[
        bool,
        typer.Option(
            "--grow",
            help="Instead of errors, measure how run time and memory grow with the number of discs. Takes no scenes.",
        ),
    ] = False,
) -> None:
    """Plot error against run time, and find the fastest engine for the accuracy you need.

    Errors are measured first. Then run times are measured while nothing else runs. Each result is written to a journal,
    so --resume continues an interrupted bench.

    Examples: `carom bench my-scene.toml`, `carom bench paper -e pymunk -e mujoco --dt 1/60..1/10000:8 --out mine`,
    `carom bench my-scene.toml --scheduler tcp://10.0.0.1:8786 --resume`.
    """
    if grow:
        if scenes:
            raise InputError(f"--grow takes no scene, got {scenes[0]!r}")
        _run_growth(plan, out, resume=resume, retry=retry, verbose=verbose)
        return
    from carom.execution.environment import describe_environment
    from carom.execution.score_jobs import score_journal
    from carom.report.files import require_report_extra
    from carom.studies.bench.baseline import BaselineChange, compare_points, read_baseline
    from carom.studies.bench.document import build_bench_document, write_bench
    from carom.studies.bench.run import measure_work_precision
    from carom.studies.bench.timing_pass import timing_journal

    if not scenes:
        raise InputError("no scene given: name a scene file or catalogue scenes, as in carom bench my-scene.toml")
    loaded_scenes = arguments.load_plain_scenes(scenes)
    require_report_extra()
    # read the file before the runs, so that errors in the file are reported at once
    before = read_baseline(baseline, describe_environment()) if baseline is not None else None
    scored, timed = out / "journal.jsonl", out / "timings.jsonl"
    with (
        error_handling.run_study(out, "bench", scored, timed) as progress,
        score_journal(scored, resume=resume, retry=retry) as journal,
        timing_journal(timed, resume=resume, retry=retry) as timings,
    ):
        result = measure_work_precision(
            loaded_scenes,
            plan,
            plan.open_pool(),
            notes=journal,
            timings=timings,
            progress=progress,
            command=get_command_line(),
        )
    changes = compare_points(result, before) if before is not None else None
    shown_axes = tuple(axes or Diagram)
    document = build_bench_document(result, shown_axes, changes)
    output.print_document(document, full=verbose, page=write_bench(result, document, out, shown_axes))
    if any(BaselineChange.REGRESSED in (one.time, one.accuracy) for one in changes or ()):
        raise typer.Exit(ExitCode.VIOLATION)


def _run_growth(plan: BenchPlan, out: Path, *, resume: bool, retry: bool, verbose: bool) -> None:
    from carom.report.files import require_report_extra
    from carom.studies.bench.growth import growth_journal, measure_growth
    from carom.studies.bench.growth_document import build_growth_document, write_growth

    if plan.profiles != BenchPlan.profiles and len(plan.profiles) > 1:
        raise InputError(f"--grow runs one profile, got {len(plan.profiles)}")
    if plan.scheduler is not None:
        reason = "run time and memory are measured on this machine"
        raise InputError(f"--scheduler must be left out, since {reason}, got {plan.scheduler!r}")
    require_report_extra()
    path = out / "growth.jsonl"
    with (
        error_handling.run_study(out, "bench", path) as progress,
        growth_journal(path, resume=resume, retry=retry) as journal,
    ):
        found = measure_growth(plan, notes=journal, progress=progress, command=get_command_line())
    document = build_growth_document(found)
    output.print_document(document, full=verbose, page=write_growth(found, document, out))
