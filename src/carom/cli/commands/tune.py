"""`carom tune`: search for the settings with which an engine has the smallest error."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from carom.cli import arguments, error_handling, output
from carom.cli.command_line import get_command_line
from carom.cli.options import add_options
from carom.studies.tune.options import TuneOptions

if TYPE_CHECKING:
    from carom.studies.tune.search import TriedSettings


@add_options(TuneOptions)
def tune(
    options: TuneOptions,
    engine: Annotated[
        str, typer.Argument(help="Engine name, or path of an engine.toml, whose adapter declares settings to tune.")
    ],
    scenes: Annotated[list[str] | None, arguments.declare_scenes_argument("classics")] = None,
    out: Annotated[
        Path, arguments.declare_out_option("Output folder for tune.md and the journal (default: tune).")
    ] = Path("tune"),
    resume: arguments.Resume = False,
    retry: arguments.Retry = False,
    verbose: arguments.Verbose = False,
) -> None:
    """Find the most accurate settings of an engine, and print them as a profile.

    The best settings have the fewest scenes that are graded "wrong" or do not run. Settings with equally many such
    scenes are ordered by the number of scenes graded "exact" or "close", then by the error, and then by the run time.

    Examples: `carom tune pymunk`, `carom tune box2d classics paper --trials 300`, `carom tune pymunk --resume --trials
    300`.
    """
    from carom.report.render.markdown import render_markdown
    from carom.studies.tune import run as search
    from carom.studies.tune.document import build_tune_document, format_set_options
    from carom.studies.tune.evaluate import tune_journal
    from carom.studies.tune.search import require_tune_extra
    from carom.support.folders import write_files

    require_tune_extra()
    name = arguments.parse_engine(engine)
    scene_names = scenes or [search.SCENES]
    loaded_scenes = arguments.load_plain_scenes(scene_names)
    path = out / search.JOURNAL
    best: list[TriedSettings] = []
    with (
        error_handling.run_study(out, search.PURPOSE, path) as progress,
        tune_journal(path, resume=resume, retry=retry) as journal,
    ):
        try:
            tuning = search.tune(
                name,
                loaded_scenes,
                options,
                notes=journal,
                progress=progress,
                on_improvement=best.append,
                command=get_command_line(),
            )
        except KeyboardInterrupt:
            if best:
                settings = format_set_options(best[-1])
                output.print_text(f"best so far (trial {best[-1].trial}): {settings}", to_stderr=True)
            raise
    document = build_tune_document(tuning, scene_names)
    report = write_files(out, search.PURPOSE, {"tune.md": render_markdown(document)})
    output.print_document(document, full=verbose, report=report)
