"""Reports, killed at any call that changes the disk: the next command finds the old files or the new ones, whole."""

import os
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from random import Random
from typing import Any

from carom.support.folders import MARKER, claim, write_files

NAMES = ("index.html", "report.md", "results.jsonl", "junit.xml", "a.svg", "a.png")


def attack(rng: Random, folder: Path) -> Iterator[str]:
    """`carom run` killed at each call that changes the disk.

    The report is completely the old or the new one.
    """
    out, number = folder / "out", 0
    while True:
        old, new = ({name: rng.randbytes(rng.choice((0, 10, 10**5))) for name in _draw_names(rng)} for _ in range(2))
        for path in [*out.glob("*"), *out.glob(".carom*/*")] if out.exists() else ():
            path.unlink() if path.is_file() else None
        write_files(out, "bench", old)
        number = (number + 1) % (4 * len(new) + 12)
        end_at(number, partial(write_files, out, "bench", new))
        os.wait()
        claim(out, "bench")
        found = {path.name: path.read_bytes() for path in out.iterdir() if path.name != MARKER}
        expected = (old, {**old, **new})
        lost = f"killed at call {number}: {sorted(found)} is neither the old nor the new report"
        yield "" if found in expected else lost


def _draw_names(rng: Random) -> list[str]:
    return rng.sample(NAMES, rng.randrange(1, len(NAMES) + 1))


def end_at(number: int, act: Callable[[], object]) -> None:
    """Start a process that ends in an act, at the call of this number."""
    if not os.fork():
        try:
            kill_at(number, partial(os._exit, 9))
            act()
        finally:
            os._exit(0)


def kill_at(number: int, kill: Callable[[], object], put: Callable[..., None] = setattr) -> None:
    """Kill before the call of so high a number, and all that follow it, of those that change the disk."""
    left = [number]

    def counted(real: Callable[..., Any]) -> Callable[..., Any]:
        def call(*args: Any, **kwargs: Any) -> Any:
            left[0] -= 1
            if left[0] < 0:
                kill()
            return real(*args, **kwargs)

        return call

    for owner, name in (
        (os, "fsync"),
        *((Path, name) for name in ("open", "mkdir", "rename", "replace", "rmdir", "unlink")),
    ):
        put(owner, name, counted(getattr(owner, name)))
