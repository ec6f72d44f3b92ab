"""Hostile adapters: each act ends in a row that says what happened, in bounded time, and nothing is left over.

The acts are those of the tests. Worker processes carry them out, as the user of the campaign; they write and delete in
folders of their own.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from random import Random
from shutil import rmtree
from unittest import mock

import pytest
from tests.attacks.guard import HangError, left_over, within
from tests.distribution import forget, lay
from tests.processes import PATIENT_S, limit_only
from tests.unit.execution.test_hostile import ACTS, SAYS, SOURCE, scene

from carom.execution.job import Status
from carom.execution.options import Options
from carom.execution.plan import build_plan
from carom.execution.pool import LocalPool
from carom.studies.cross_check.run import execute

MARK = "CAROM_ATTACK=hostile"
#: Time limit of an act that never answers: long enough for its process to start on a machine that is busy.
LIMIT_S = 20.0
#: No act takes longer, though the machine is busy with other attacks.
LONGEST_S = 4.0 * PATIENT_S


def attack(rng: Random, folder: Path) -> Iterator[str]:
    """Run each act next to PIT."""
    while True:
        # The act that kills a template has no answer of its own: here there is none, and it would kill the campaign.
        for name in rng.sample([*SAYS], len(SAYS)):
            with _installed(folder):
                lost = _lost(name, folder)
            yield lost  # what comes between two tries knows none of these adapters


def _lost(name: str, folder: Path) -> str:
    """Return what is wrong after an act, empty where nothing is."""
    asked = Options(("pit", name), [0.1], ["tuned"], timing=False, samples=False)
    try:
        with (
            pytest.MonkeyPatch.context() as patch,
            within(LONGEST_S, busy=1.0),
            LocalPool(2, LIMIT_S, memory_limit_mb=1500) as pool,
        ):
            limit_only(patch, *[name] * (SAYS[name][0] is Status.TIMED_OUT))
            rows = {row.job.engine: row for row in execute(build_plan([scene()], asked, pool), pool).rows}
    except HangError:
        return f"{name}: no end after {LONGEST_S:g} s"
    status, words = SAYS[name]
    row = rows[name]
    if row.status is not status or words not in row.reason:
        return f"{name}: {row.status.value}: {row.reason[:300]!r}"
    if rows["pit"].status is not Status.RAN:
        return f"{name}: the other row, too: {rows['pit'].reason[:300]!r}"
    left = left_over(MARK, folder / "temporary")
    return left and f"{name}: {left}"


@contextmanager
def _installed(folder: Path) -> Iterator[None]:
    """Install the adapters for this process and its children: a distribution in a folder of its own."""
    rmtree(folder / "site", ignore_errors=True)
    for name in ("site", "here", "temporary"):
        (folder / name).mkdir(exist_ok=True)
    made = "".join(f"{name.replace('-', '_')} = Adapter({name!r}, {act!r})\n" for name, act in ACTS.items())
    (folder / "site" / "hostile_attack.py").write_text(SOURCE + made)
    lay(folder / "site", "hostile_attack", {name: f"hostile_attack:{name.replace('-', '_')}" for name in ACTS})
    mark, _, value = MARK.partition("=")
    environment = {mark: value, "CAROM_TEST_FOLDER": str(folder / "here"), "TMPDIR": str(folder / "temporary")}
    with mock.patch.dict(os.environ, environment), mock.patch.object(sys, "path", [str(folder / "site"), *sys.path]):
        forget()
        yield
    forget()
