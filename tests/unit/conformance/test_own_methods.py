"""The cases of conformance, asked in this process: Carom's own method has to pass every one that is about it."""

from __future__ import annotations

import re
from contextlib import closing
from pathlib import Path

import pytest
from tests.lengths import long_after

from carom.conformance.suite import make_suite
from carom.conformance.violation import NotApplicable
from carom.runs.options import Limited


@pytest.mark.parametrize(
    ("profiles", "scenes", "least"), long_after(1, [(["tuned"], "classics/box|spin/gearing", 50), ([], "", 200)])
)
def test_pic_passes_every_case(profiles: list[str], scenes: str, least: int, tmp_path: Path) -> None:
    """What an adapter may declare, PIC does; nearly all are about it, and none fails: tuned on two scenes, or all."""
    (engine,) = make_suite(["pic"], profiles, None, [tmp_path], Limited()).engines
    assert engine.subject is not None
    held = 0
    with closing(engine.subject) as subject:
        for case in engine.cases:
            if not case.skip and ("/" not in case.name or re.search(scenes, case.name)):
                try:
                    case.run(subject)
                except NotApplicable:
                    continue
                held += 1
    assert held > least
