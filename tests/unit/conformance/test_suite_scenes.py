"""Runs of the conformance suite with Carom's own methods, in this process."""

import re
from contextlib import closing
from pathlib import Path

from tests.cases import each, release_after

from carom.conformance.suite import make_suite
from carom.conformance.violation import NotApplicable
from carom.execution.shared_options import LimitOptions


@each("profiles, scenes, least", release_after(1, [(["tuned"], "classics/box|spin/gearing", 50), ([], "", 200)]))
def test_pic_passes_every_conformance_case(profiles: list[str], scenes: str, least: int, tmp_path: Path) -> None:
    """PIC passes every case of the suite that applies to it, and a minimum number applies."""
    (engine,) = make_suite(["pic"], profiles, None, [tmp_path], LimitOptions()).engines
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
