"""`carom certify`: run scenes in ball arithmetic and print the impacts with their proven digits only."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from carom.cli.common import EXIT_INTERRUPTED, EXIT_VIOLATION, guarded, plain_scenes_named, print_document

if TYPE_CHECKING:
    from carom.scene import Scene
    from carom.solvers.certified import CertifiedTrace

__all__ = ["certify"]


@guarded
def certify(
    scenes: Annotated[
        list[str],
        typer.Argument(help="Scene files (.toml, .json), or scenes of the catalogue by name, group or pattern."),
    ],
    digits: Annotated[int, typer.Option("--digits", "-d", min=1, help="Decimal digits to prove.")] = 15,
    max_impacts: Annotated[
        int | None, typer.Option("--max-impacts", "-n", min=0, help="Stop after so many impacts.")
    ] = None,
    time_budget: Annotated[
        float | None, typer.Option("--time-budget", "-t", help="Stop after so many seconds, each scene.")
    ] = None,
    max_precision: Annotated[
        int, typer.Option("--max-precision", help="Never compute with more bits than these.")
    ] = 65536,
    show: Annotated[int, typer.Option("--show", min=0, help="Print so many impacts of each scene.")] = 40,
    as_json: Annotated[bool, typer.Option("--json", help="Print all impacts with their radii as JSON.")] = False,
    out: Annotated[Path | None, typer.Option("--out", "-o", help="Folder to write one JSON file a scene into.")] = None,
) -> None:
    """Run scenes in ball arithmetic: every digit printed is proven.

    A run ends at the end of its scene, at a limit, or at an event that has no certain answer, which is named.
    Needs python-flint: `pip install 'carom[certify]'`. Exit code 1: a scene was not certified to its end or limit.

    Examples: `carom certify classics/gas`, `carom certify my-scene.toml --digits 30 --max-impacts 100`,
    `carom certify my-scene.toml --time-budget 10 --json`.
    """
    from carom.report.small import certified_document
    from carom.solvers.certified import Ending, enclosures

    if out is not None:
        out.mkdir(parents=True, exist_ok=True)
    worst = 0
    documents = []
    for scene in plain_scenes_named(scenes):
        found = _certify(scene, digits, max_impacts, time_budget, max_precision)
        if as_json or out is not None:
            document = enclosures(found)
            documents.append(document)
            if out is not None:
                path = out / f"{scene.name.replace('/', '-')}.json"
                path.write_text(json.dumps(document, indent=1) + "\n", encoding="utf-8")
        if not as_json:
            print_document(certified_document(found, show))
        if found.ending is Ending.INTERRUPTED:
            worst = EXIT_INTERRUPTED
            break
        if found.ending not in (Ending.COMPLETED, Ending.MAX_IMPACTS):
            worst = EXIT_VIOLATION
    if as_json:
        typer.echo(json.dumps(documents if len(documents) > 1 else documents[0], indent=1))
    if worst:
        raise typer.Exit(worst)


def _certify(
    scene: Scene, digits: int, max_impacts: int | None, time_budget: float | None, max_precision: int
) -> CertifiedTrace:
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

    from carom.solvers.certified import certify

    columns = (BarColumn(), TimeElapsedColumn(), TextColumn("{task.description}"))
    with Progress(*columns, console=Console(stderr=True), transient=True, disable=not sys.stderr.isatty()) as bar:
        task = bar.add_task(scene.name, total=scene.duration_s if max_impacts is None else max_impacts)

        def progress(impacts: int, time_s: float, bits: int) -> None:
            done = time_s if max_impacts is None else impacts
            bar.update(task, completed=done, description=f"{impacts} impacts to {time_s:.4g} s with {bits} bits")

        return certify(
            scene,
            digits=digits,
            max_impacts=max_impacts,
            time_budget_s=time_budget,
            max_precision_bits=max_precision,
            progress=progress,
        )
