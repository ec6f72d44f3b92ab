"""`carom stress`: attack methods with scenes made to break numerics, and print where each gives way."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from carom.cli import shared

__all__ = ["stress"]


@shared.guarded
def stress(
    attacks: Annotated[
        list[str] | None,
        typer.Argument(
            help="Attacks, relations or complaints by name, or all of a kind: attacks, relations, complaints. "
            "All by default; --list shows them."
        ),
    ] = None,
    engine: shared.EngineNames = None,
    profile: shared.ProfileNames = None,
    quick: Annotated[
        bool, typer.Option("--quick", help="The quick form: under a minute, with fewer rungs and nearer ends.")
    ] = False,
    resume: shared.Resume = False,
    retry: shared.Retry = False,
    out: Annotated[
        Path,
        typer.Option(
            "--out",
            help="Folder for stress.html, stress.md, stress.json, the journal, and scenes/ with the scene of each "
            "number.",
        ),
    ] = Path("stress"),
    jobs: shared.Jobs = None,
    time_limit: Annotated[
        float | None,
        typer.Option("--time-limit", help="Seconds after which an engine that gives no answer has given way."),
    ] = None,
    verbose: shared.Verbose = False,
    memory_limit: shared.MemoryLimit = None,
    list_only: Annotated[bool, typer.Option("--list", help="List what there is, and leave.")] = False,
) -> None:
    """Attack methods with scenes made to break numerics, and print the size at which each gives way.

    Examples: `carom stress --quick`, `carom stress grazing tunnelling -e mujoco`,
    `carom stress --out reports/stress --resume`.
    """
    from carom.folders import claimed
    from carom.limits import require_seconds
    from carom.stress import campaign

    if list_only:
        for line in campaign.listing(quick=quick):
            shared.say(f"{line.kind:10} {line.name:24} {line.axis}")
        return
    if time_limit is not None:
        require_seconds("--time-limit", time_limit)
    from carom.report.files import require_report_extra
    from carom.report.stress_document import stress_document, write_stress

    require_report_extra()
    with (
        claimed(out, campaign.PURPOSE, "--out"),
        shared.resumable(out / campaign.JOURNAL),
        shared.progress_bar() as progress,
    ):
        results = campaign.stress(
            attacks or [],
            engine,
            out=out,
            resume=resume,
            retry=retry,
            progress=progress,
            command=shared.command_line(),
            profiles=tuple(profile or ("default", "tuned")),
            quick=quick,
            jobs=jobs,
            time_limit_s=time_limit,
            memory_limit_mb=memory_limit,
        )
    page = write_stress(results, out)
    shared.print_document(stress_document(results), full=verbose)
    shared.say_place("report", page)
    if any(info.unavailable for name, info in results.engines.items() if name in (engine or ())):
        raise typer.Exit(shared.EXIT_UNAVAILABLE)
