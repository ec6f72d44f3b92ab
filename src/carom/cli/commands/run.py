"""`carom run`: run scenes on engines, compare each run with PIC, and print a table of grades."""

from __future__ import annotations

import shlex
from contextlib import AbstractContextManager, nullcontext
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from carom.cli import arguments, error_handling, output
from carom.cli.command_line import get_command_line
from carom.cli.exit_codes import ExitCode
from carom.cli.options import add_options
from carom.errors import InputError
from carom.execution.shared_options import FailOn
from carom.studies.cross_check.options import Options

if TYPE_CHECKING:
    from carom.comparator import Grade
    from carom.execution.pool import Pool
    from carom.execution.results import Results
    from carom.studies.cross_check.plan import Plan


@add_options(Options)
def run(
    options: Options,
    scenes: Annotated[
        list[str] | None,
        typer.Argument(
            help="Scene files (.toml, .json), or names, groups or patterns of catalogue scenes "
            "(default: the whole catalogue)."
        ),
    ] = None,
    out: Annotated[
        Path | None,
        arguments.declare_out_option("Output folder for the report: index.html, report.md, results.jsonl, junit.xml."),
    ] = None,
    report: Annotated[Path | None, typer.Option("--report", hidden=True)] = None,
    resume: arguments.Resume = False,
    retry: arguments.Retry = False,
    explain: Annotated[
        bool,
        typer.Option("--explain", help="Print which runs are planned or left out, with the reasons, and exit."),
    ] = False,
    verbose: arguments.Verbose = False,
    fail_on: Annotated[
        FailOn,
        typer.Option(
            "--fail-on",
            show_default=False,
            help="Exit with code 1 if a run has this grade or a worse one (default: inaccurate).",
        ),
    ] = FailOn.INACCURATE,
) -> None:
    """Print how accurately engines run scenes, compared with the exact solution (PIC).

    Examples: `carom run`, `carom run paper classics/galperin-100 -e pymunk -e mujoco`,
    `carom run my-scene.toml --engine mujoco --dt 1/240 --out reports/mine`,
    `carom run classics -e pymunk -p tuned --set iterations=5`.
    """
    from carom.comparator import Grade
    from carom.report.files import require_report_extra
    from carom.studies.cross_check.document import PURPOSE
    from carom.studies.cross_check.plan import build_plan
    from carom.support.folders import claim_while_writing

    out = out or report
    # only a report shows pictures and run times
    options = replace(options, samples=out is not None, timing=options.timing and out is not None)
    loaded_scenes = arguments.load_scenes(scenes or [])
    if out is None and (resume or retry):
        raise InputError("--resume and --retry need the output folder: give --out")
    if out is None or explain:
        folder: AbstractContextManager[None] = nullcontext()
    else:
        require_report_extra()
        # check the folder first, because querying the engines takes seconds
        folder = claim_while_writing(out, PURPOSE, "--out")
    with options.open_pool() as pool, folder:
        plan = build_plan(loaded_scenes, options, pool)
        if explain:
            from carom.studies.cross_check.explain import explain as explained

            for line in explained(plan):
                output.print_text(line)
            return
        worst_grade = None if fail_on is FailOn.NEVER else Grade[fail_on.name]
        results = _carry_out_plan(plan, pool, out, worst_grade, resume=resume, retry=retry, verbose=verbose)
        if len(loaded_scenes) == 1:
            _print_settings(results, (scenes or [loaded_scenes[0].name])[0])
    code = _choose_exit_code(results, set(options.engines or ()), worst_grade)
    if code:
        raise typer.Exit(code)


def _carry_out_plan(
    plan: Plan, pool: Pool, report: Path | None, fail_on: Grade | None, *, resume: bool, retry: bool, verbose: bool
) -> Results:
    """Run the jobs of a plan, write the report if requested, and print the table of grades."""
    from carom.studies.cross_check.document import build_report, cross_check_document
    from carom.studies.cross_check.run import execute, observed_journal

    if report is None:
        with output.show_progress_bar() as progress:
            results = execute(plan, pool, progress=progress, command=get_command_line())
        output.print_document(cross_check_document(results), full=verbose)
        return results
    path = report / "journal.jsonl"
    with (
        error_handling.guard_journals(path),
        observed_journal(path, plan.options.stamp, resume=resume, retry=retry) as journal,
        output.show_progress_bar() as progress,
    ):
        found = execute(plan, pool, notes=journal, progress=progress, command=get_command_line())
        built_report = build_report(found, fail_on)
        page = built_report.write(report)
        path.unlink(missing_ok=True)  # the report contains all results of the journal
    output.print_document(built_report.document, full=verbose, report=page)
    return built_report.results


def _print_settings(results: Results, scene: str) -> None:
    """For the most accurate method, print the ``carom engines`` command that shows its settings as code."""
    from carom.engines.registry import format_engine_argument
    from carom.studies.cross_check.grid import build_grid, rank_methods
    from carom.support.formatting import format_step_option

    grid, infos = build_grid(results), {info.name: info for info in results.engines}
    for method in rank_methods(grid, grid.methods):
        info = infos[method.engine]
        steps = [cell.line.dt_s for cell in grid.list_cells(method) if cell.scored]
        if method.is_own or method.overrides or not info.code or method.profile in info.located or not steps:
            continue
        words = ("carom", "engines", format_engine_argument(method.engine), "--show", method.profile)
        command = shlex.join((*words, "--dt", format_step_option(max(steps)), "--scene", scene))
        output.print_text(f"To print the settings of {method.title} as code:\n{command}")
        return


def _choose_exit_code(results: Results, requested: set[str], fail_on: Grade | None) -> int:
    from carom.execution.job import Status
    from carom.execution.results import is_violation

    if any(row.status.is_failure for row in results.rows):
        return ExitCode.CRASHED
    if any(row.status is Status.UNAVAILABLE and row.job.engine in requested for row in results.rows):
        return ExitCode.UNAVAILABLE
    if all(row.score is None for row in results.rows):  # no job has run
        return ExitCode.UNAVAILABLE
    if fail_on is not None and any(is_violation(row, fail_on) for row in results.rows):
        return ExitCode.VIOLATION
    return 0
