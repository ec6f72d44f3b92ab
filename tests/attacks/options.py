"""Values of every option of every command: each is taken, or refused in a sentence with exit code 2, in seconds.

The commands run in this process, and so do the engines, which are Carom's own: what is tried is the value, not the
worker. What takes more than ten seconds that way is tried again as a command, with a time limit.
"""

import subprocess
import sys
from collections.abc import Iterator
from contextlib import chdir
from pathlib import Path
from random import Random
from shutil import rmtree
from unittest.mock import patch

from tests.attacks.guard import HangError, limit_time
from tests.in_process_pool import InProcessPool
from tests.processes import run_command
from typer.testing import CliRunner

from carom.cli import app

#: A command that is quickly done, and options of it that take a value.
COMMANDS = {
    ("run", "paper/missed", "-e", "pit", "--no-timing"): (
        *("--dt", "--profile", "--phases", "--jobs", "--time-limit", "--memory-limit", "--certify-time", "--fail-on"),
        *("--engine", "--report"),
    ),
    ("bench", "paper/missed", "-e", "pit", "--no-timing", "--dt", "1/60", "--budget", "5", "--out", "out"): (
        *("--dt", "--profile", "--phases", "--rounds", "--seed", "--budget", "--target", "--error", "--axes"),
        *("--time-limit", "--memory-limit", "--jobs", "--discs", "--scheduler"),
    ),
    ("advise", "paper/missed", "-e", "pymunk", "--budget", "2000"): (
        *("--direction-error", "--miss-probability", "--phases", "--budget", "--time-limit", "--jobs", "--profile"),
    ),
    ("stress", "small", "-e", "pit", "--quick", "--out", "out"): (
        *("--time-limit", "--jobs", "--profile", "--memory-limit"),
    ),
    ("certify", "paper/missed"): ("--digits", "--max-impacts", "--time-budget", "--max-precision", "--show", "--out"),
    ("scenes", "paper/missed"): ("--save",),
}
WORDS = [
    *("", " ", "9" * 400, "a" * 5000, "1 deg", "\u0661", "\u221e", "\x1b[31m", "\u202eabc"),
    *("0", "-0", "1", "-1", "2", "3", "16", "1024", "1025", "1000000", "18446744073709551616", "-9223372036854775809"),
    *("1_000", "0x10", "1e", "0.1", "0.004", "1e-9", "1e6", "1e10"),
    *("1e300", "1e-300", "5e-324", "1e400", "1e999999999"),
    *("inf", "-inf", "nan", "1/0", "0/0", "1/60", "1/1e308"),
    *("1/60..1/120", "1/60..1/120:0", "1/60..1/120:1", "1/60..1/120:256", "1/60..1/120:99999999"),
    *("1e300..1e-300:5", "..", ":", "1..2:3:4", "1deg", "0deg", "180deg", "1e-300rad", "nandeg", "deg"),
    *("all", "default", "tuned", "impact", "wrong", "never", "[bold]", "[/]", "{}", "%s", "--resume", "-"),
    *("/dev/null", "/dev/full", "/proc/x"),
]

#: What is asked for may be a minute's work of a processor, 1024 phases of a scene say, and machines are shared.
LONGEST_S = 600.0


def attack(rng: Random, folder: Path) -> Iterator[str]:
    """Random values of options.

    The value is accepted, or refused with a message and exit code 2.
    """
    tries = [(command, option, word) for command, options in COMMANDS.items() for option in options for word in WORDS]
    rng.shuffle(tries)
    while True:
        for command, option, word in tries:
            work = folder / "work"
            rmtree(work, ignore_errors=True)  # of a campaign that was killed
            yield _try_in_process([*command, option, word], work)
        tries = [(command, option, rng.choice(WORDS) + rng.choice(WORDS)) for command, option, _ in tries]


def _try_in_process(arguments: list[str], work: Path) -> str:
    shown = " ".join(arguments)[:300]
    work.mkdir()
    try:
        with chdir(work), patch("carom.execution.pool.LocalPool", lambda *_, **__: InProcessPool()), limit_time():
            result = CliRunner().invoke(app, arguments)
            error = result.exception
    except HangError as hang:
        error = hang
    finally:
        rmtree(work)
    if isinstance(error, HangError):
        return _try_as_command(arguments, shown, work)
    if error is not None and not isinstance(error, SystemExit):
        return f"{shown!r}: {type(error).__name__}: {str(error)[:200]!r}"
    if result.exit_code == 2 and not result.output.strip():
        return f"{shown!r}: refused without a sentence"
    return "" if "\x1b[31m" not in result.output else f"{shown!r}: an escape sequence in the output"


def _try_as_command(arguments: list[str], shown: str, work: Path) -> str:
    work.mkdir()
    limited = [*arguments, "--time-limit", "3"] if arguments[0] in {"run", "bench", "advise", "stress"} else arguments
    try:
        command = [sys.executable, "-m", "carom", *limited]
        done = run_command(command, cwd=work, timeout=LONGEST_S, check=False)
    except subprocess.TimeoutExpired:
        return f"{shown!r}: no answer within {LONGEST_S:g} s, with a time limit of 3 s"
    finally:
        rmtree(work)
    return f"{shown!r}: {done.stderr[-300:]}" if "Traceback" in done.stderr else ""
