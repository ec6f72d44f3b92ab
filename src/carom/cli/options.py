"""Options that several commands have: one name, one meaning, one help text."""

from __future__ import annotations

from typing import Annotated

import typer

__all__ = ["EngineNames", "Jobs", "ProfileNames", "TimeLimit"]

EngineNames = Annotated[list[str] | None, typer.Option("--engine", "-e", help="Engine, repeatable. All by default.")]

ProfileNames = Annotated[
    list[str] | None,
    typer.Option("--profile", "-p", help="Settings profile, repeatable. By default 'default' and 'tuned'."),
]

Jobs = Annotated[
    int | None, typer.Option("--jobs", "-j", min=1, help="Runs at a time. As many as there are cores by default.")
]

TimeLimit = Annotated[
    float, typer.Option("--time-limit", help="Seconds after which a run that gives no answer is ended.")
]
