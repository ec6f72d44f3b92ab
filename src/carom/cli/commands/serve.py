"""`carom serve`: serve a Python adapter as a program that uses the engine protocol."""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import Annotated

import typer


def serve(
    adapter: Annotated[str, typer.Argument(help="Name of a Python adapter, as listed by carom engines.")],
    path: Annotated[
        Path | None,
        typer.Option(
            "--path", help="Folder that is searched first for packages, such as another release of the engine."
        ),
    ] = None,
    manifest: Annotated[
        str | None,
        typer.Option("--manifest", metavar="NAME", help="Print an engine.toml for an engine of this name, and exit."),
    ] = None,
) -> None:
    """Serve a Python adapter over standard input/output using the engine protocol.

    Examples: `carom serve pymunk --path old/pymunk-6.4.0 --manifest pymunk-6.4.0 > old.toml`, then
    `carom run classics -e pymunk -e ./old.toml`.
    """
    # Anything that the engine prints goes to standard error, so that standard output contains only answers.
    answers = os.fdopen(os.dup(sys.stdout.fileno()), "w", encoding="utf-8", buffering=1)
    os.dup2(sys.stderr.fileno(), sys.stdout.fileno())
    if path is not None:
        sys.path.insert(0, str(path.resolve()))
    from carom.engines.protocol import serve as program
    from carom.engines.registry import distribution_of, explain_unavailable_adapter, find_version, load_adapter
    from carom.errors import AdapterError

    loaded_adapter = load_adapter(adapter)
    version = find_version(loaded_adapter, distribution_of(adapter))
    if manifest is not None:
        path_options = [] if path is None else ["--path", str(path.resolve())]
        command = [sys.executable, "-m", "carom", "serve", adapter, *path_options]
        answers.write(program.build_manifest(loaded_adapter, manifest, version, command))
        answers.close()
        return
    if reason := explain_unavailable_adapter(loaded_adapter):
        raise AdapterError(f"{adapter}: {reason}")
    program.serve(program.Server(loaded_adapter, version), sys.stdin, answers.write)
