"""`carom stress`: make scenes harder and harder, and find at which value of a quantity each engine fails."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from carom.cli import arguments, error_handling, output
from carom.cli.command_line import get_command_line
from carom.cli.exit_codes import ExitCode
from carom.cli.options import add_options
from carom.studies.stress.options import StressOptions


@add_options(StressOptions)
def stress(
    options: StressOptions,
    attacks: Annotated[
        list[str] | None,
        typer.Argument(
            help="Names of stress tests, invariances or reported bugs. Three names mean all of a kind: attacks (stress "
            "tests), relations (invariances), complaints (reported bugs). Default: all kinds. --list shows the "
            "names."
        ),
    ] = None,
    resume: arguments.Resume = False,
    retry: arguments.Retry = False,
    out: Annotated[
        Path,
        arguments.declare_out_option(
            "Output folder for stress.html, stress.md, stress.json, the journal, and one scene per failure "
            "(default: stress)."
        ),
    ] = Path("stress"),
    verbose: arguments.Verbose = False,
    list_only: Annotated[bool, typer.Option("--list", help="List all stress tests and exit.")] = False,
) -> None:
    """Find the value of a quantity, such as a speed, at which each engine fails.

    Examples: `carom stress --quick`, `carom stress grazing tunnelling -e mujoco`,
    `carom stress --out reports/stress --resume`.
    """
    from carom.studies.stress import run as campaign

    if list_only:
        for line in campaign.list_rows(quick=options.quick):
            output.print_text(f"{line.kind:10} {line.name:24} {line.axis}")
        return
    from carom.report.files import require_report_extra
    from carom.studies.stress.document import build_stress_document, write_stress

    require_report_extra()
    with error_handling.run_study(out, campaign.PURPOSE, out / campaign.JOURNAL) as progress:
        results = campaign.run_stress_campaign(
            attacks or [], options, out=out, resume=resume, retry=retry, progress=progress, command=get_command_line()
        )
    document = build_stress_document(results)
    output.print_document(document, full=verbose, report=write_stress(results, document, out))
    if any(info.unavailable for name, info in results.engines.items() if name in (options.engines or ())):
        raise typer.Exit(ExitCode.UNAVAILABLE)
