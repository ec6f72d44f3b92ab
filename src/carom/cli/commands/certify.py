"""`carom certify`: compute impacts with proven digits by ball arithmetic."""

from __future__ import annotations

import json
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from carom.cli import arguments, output
from carom.cli.exit_codes import ExitCode
from carom.cli.options import add_options
from carom.solvers.certified.options import CertifyOptions
from carom.support.formatting import format_number

if TYPE_CHECKING:
    from carom.execution.job import Progress
    from carom.model.scene import Scene

#: Word that marks output folders of this command.
PURPOSE = "certified"


@add_options(CertifyOptions)
def certify(
    options: CertifyOptions,
    scenes: Annotated[list[str], arguments.SCENE_NAMES],
    show: Annotated[
        int,
        typer.Option("--show", min=0, show_default=False, help="Number of impacts to print per scene (default: 40)."),
    ] = 40,
    as_json: Annotated[bool, typer.Option("--json", help="Print all impacts with their error radii as JSON.")] = False,
    out: Annotated[Path | None, arguments.declare_out_option("Output folder for one JSON file per scene.")] = None,
) -> None:
    """Compute impacts with proven digits, by ball arithmetic.

    A run ends at the end of its scene, at a limit, or at an event whose outcome can't be proven. The command prints why
    each run ended. Sliding, rolling and resting on straight walls are supported. Needs python-flint: `pip install
    'carom[certify]'`. Exit code 1: a run ended early, but not because of --max-impacts.

    Examples: `carom certify classics/gas`, `carom certify my-scene.toml --digits 30 --max-impacts 100`,
    `carom certify my-scene.toml --time-budget 10 --json`.
    """
    from carom.report.certified import build_certified_document
    from carom.solvers.certified.certify import certify as certified
    from carom.solvers.certified.result import Ending
    from carom.solvers.certified.serialisation import enclosures
    from carom.support.folders import build_file_name, claim, write_files

    worst = 0
    documents = []
    found_scenes = arguments.load_plain_scenes(scenes)
    if out is not None:
        claim(out, PURPOSE, "--out")
    for scene in found_scenes:
        with output.show_progress_bar() as show_progress:
            progress = partial(_show_progress, show_progress, scene, options.max_impacts)
            result = certified(scene, **vars(options), progress=progress)
        if as_json or out is not None:
            document = enclosures(result)
            documents.append(document)
            if out is not None:
                text = json.dumps(document, indent=1) + "\n"
                write_files(out, PURPOSE, {f"{build_file_name(scene.name)}.json": text})
        if not as_json:
            output.print_document(build_certified_document(result, show))
        if result.ending is Ending.INTERRUPTED:
            worst = ExitCode.INTERRUPTED
            break
        if result.ending not in (Ending.COMPLETED, Ending.MAX_IMPACTS):
            worst = ExitCode.VIOLATION
    if as_json:
        typer.echo(json.dumps(documents if len(documents) > 1 else documents[0], indent=1))
    if worst:
        raise typer.Exit(worst)


def _show_progress(
    show: Progress, scene: Scene, max_impacts: int | None, impacts: int, time_s: float, bits: int
) -> None:
    done, total = (round(100 * time_s / scene.duration_s), 100) if max_impacts is None else (impacts, max_impacts)
    show(done, total, f"{impacts} impacts to {format_number(time_s, 4)} s with {bits} bits")
