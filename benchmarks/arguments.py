"""Command lines of the benchmarks, which run as modules: ``python -m benchmarks.pic --help``."""

from __future__ import annotations

import argparse
import math
from collections.abc import Callable

from carom.errors import CaromError

#: Exit code of a command that Ctrl-C ended, as in a shell.
INTERRUPTED = 130


def parser(module: str, doc: str | None) -> argparse.ArgumentParser:
    """Return the parser of a module's arguments. The help text is from the module's docstring."""
    described = (doc or "").partition(": ``python -m")[0]
    return argparse.ArgumentParser(
        prog=f"python -m {module}",
        description=f"{described}.",
        formatter_class=argparse.ArgumentDefaultsHelpFormatter,
    )


def count(text: str) -> int:
    """Read a whole number of 1 or more, such as ``1000`` or ``1e6``.

    Raises:
        argparse.ArgumentTypeError: The text is not a whole number of 1 or more.
    """
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not (value >= 1 and value.is_integer()):
        raise argparse.ArgumentTypeError(f"must be a whole number of 1 or more, such as 1000 or 1e6, got {text!r}")
    return int(value)


def run(arguments: argparse.ArgumentParser, main: Callable[..., None]) -> None:
    """Parse the command line and call `main` with the arguments. Errors are shown in one line, without a traceback."""
    try:
        main(**vars(arguments.parse_args()))
    except (CaromError, OSError) as error:
        arguments.error(str(error))
    except KeyboardInterrupt:
        arguments.exit(INTERRUPTED, "interrupted\n")
