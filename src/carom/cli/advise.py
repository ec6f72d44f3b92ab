"""`carom advise`: the largest step that is good enough for a scene."""

from __future__ import annotations

import math
from typing import Annotated

import typer

from carom.cli import shared
from carom.errors import InputError
from carom.limits import ADVICE_STEPS, MOST_PHASES, require_seconds

__all__ = ["advise"]


@shared.guarded
def advise(
    scene: Annotated[str, typer.Argument(help="A scene file (.toml, .json), or one scene of the catalogue by name.")],
    direction_error: Annotated[
        str,
        typer.Option("--direction-error", help="No direction may be wrong by more: 1deg, or in radians 0.02rad."),
    ] = "1deg",
    miss_probability: Annotated[
        float,
        typer.Option("--miss-probability", help="Share of starts at which an impact may be missed, 0 to below 1."),
    ] = 0.0,
    engine: shared.EngineNames = None,
    profile: shared.ProfileNames = None,
    phases: Annotated[
        int,
        typer.Option(
            "--phases", min=1, max=MOST_PHASES, help="Starts, spread evenly over a step, that each step is tried at."
        ),
    ] = 8,
    jobs: shared.Jobs = None,
    time_limit: shared.TimeLimit = 60.0,
    memory_limit: shared.MemoryLimit = None,
    budget: Annotated[
        int, typer.Option("--budget", min=1, help="Engine steps that the search of one method may take.")
    ] = ADVICE_STEPS,
    verbose: shared.Verbose = False,
) -> None:
    """Say from which step on each engine misses no impact of a scene, and meets a demand, and which impact asks for it.

    Every step of a grid is tried, from the whole run in one step down, at starts spread over it and at unlucky ones. An
    answer is a range: every step tried in it passes, and the next larger one that was run fails.

    Examples: `carom advise my-scene.toml`, `carom advise paper/missed --direction-error 5deg --miss-probability 0.1`.
    """
    from carom.bench.adviser import Demand
    from carom.bench.adviser import advise as find
    from carom.report.advice_document import advice_document
    from carom.runs.pool import LocalPool

    found = shared.plain_scenes_named([scene])
    if len(found) != 1:
        raise InputError(f"{scene!r} names {len(found)} scenes, and advice is for one")
    require_seconds("--time-limit", time_limit)
    with LocalPool(jobs, time_limit, memory_limit) as pool, shared.progress_bar() as progress:
        advice = find(
            found[0],
            Demand(angle(direction_error), miss_probability),
            pool,
            engine,
            profiles=tuple(profile or ("default", "tuned")),
            phases=phases,
            budget_steps=budget,
            progress=progress,
        )
    shared.print_document(advice_document(advice), full=verbose)


def angle(text: str) -> float:
    """Read an angle such as ``1deg`` or ``0.02rad``, in radians."""
    for unit, scale in (("deg", math.pi / 180.0), ("rad", 1.0)):
        if text.endswith(unit):
            try:
                return float(text.removesuffix(unit)) * scale
            except ValueError:
                break
    raise InputError(f"--direction-error must be an angle such as 1deg or 0.02rad, got {text!r}")
