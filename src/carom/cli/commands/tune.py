"""`carom tune`: look for the settings of an engine that give the least error for a cost."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from carom.cli import common
from carom.cli.command_line import command_line
from carom.cli.options import asking
from carom.studies.tune.options import TuneOptions

if TYPE_CHECKING:
    from carom.studies.tune.search import Found


@asking(TuneOptions)
def tune(
    options: TuneOptions,
    engine: Annotated[
        str, typer.Argument(help="Engine, or the engine.toml of one that is a program. Its adapter declares the knobs.")
    ],
    scenes: Annotated[
        list[str] | None,
        typer.Argument(help="Scene files, or scenes of the catalogue by name, group or pattern. By default classics."),
    ] = None,
    out: Annotated[Path, typer.Option("--out", "-o", help="Folder for tune.md and the journal.")] = Path("tune"),
    resume: common.Resume = False,
    retry: common.Retry = False,
    verbose: common.Verbose = False,
) -> None:
    """Look for the settings of an engine that give the least error for a cost, and print them as a profile.

    First come scenes wrong, then those neither exact nor close, then the error over PIT's, then the cost.

    Examples: `carom tune pymunk`, `carom tune box2d classics paper --trials 300`, `carom tune pymunk --resume --trials
    300`.
    """
    from carom.studies.tune import run as search
    from carom.studies.tune.document import set_words, tune_document, write_tune
    from carom.studies.tune.evaluate import tune_journal
    from carom.studies.tune.search import require_tune_extra

    require_tune_extra()
    (name,) = common.engines_named([engine]) or [engine]
    asked = scenes or [search.SCENES]
    named = common.plain_scenes_named(asked)
    path = out / search.JOURNAL
    best: list[Found] = []
    with (
        common.studied(out, search.PURPOSE, path) as progress,
        tune_journal(path, resume=resume, retry=retry) as journal,
    ):
        try:
            found = search.tune(
                name,
                named,
                options,
                notes=journal,
                progress=progress,
                told=best.append,
                command=command_line(),
            )
        except KeyboardInterrupt:
            if best:
                common.say(f"best so far, in trial {best[-1].trial}: {set_words(best[-1])}", apart=True)
            raise
    page = write_tune(found, asked, out)
    common.print_document(tune_document(found, asked), full=verbose, report=page)
