"""A run that fails is explained by what its engine printed meanwhile, and by nothing that was printed for another."""

from __future__ import annotations

import re
from collections.abc import Callable

from carom import Disc, Scene
from carom.runs.job import Job, Method, Status
from carom.runs.observe import Observe
from carom.runs.pool import Lane

SOURCE = """
import ctypes, sys
from carom.adapter import Capabilities, Engine, Profile

class Adapter:
    name, engine, capabilities = "says", Engine("Says"), Capabilities()
    profiles = {"tuned": Profile("as it comes", lambda dt: {"dt_s": dt})}

    def prepare(self, scene, settings):
        match settings["dt_s"]:
            case 1.0:
                print("a contact too many\\n  ")
            case 0.5:
                print("overflow", file=sys.stderr)
            case 0.25:
                ctypes.CDLL(None).puts(b"told from C")
            case 0.125:
                sys.stderr.close()
        raise RuntimeError("boom")

adapter = Adapter()
"""


def test_a_failure_is_explained_by_its_own_last_words(install: Callable[[str, dict[str, str]], None]) -> None:
    """Of tasks in one message each has what it printed itself, from Python or C, and a silent one has nothing."""
    install(SOURCE, {"says": "adapter"})
    scene = Scene(name="still", discs=[Disc(position_m=(0, 0), radius_m=1)], duration_s=1)
    steps = (1.0, 0.5, 2.0, 0.25, 0.125, 1.0)
    with Lane(60.0) as lane:
        answers = list(lane.ask_each([Observe(Job(scene, Method("says", "tuned"), dt_s)) for dt_s in steps]))
    assert {answer.status for answer in answers} == {Status.FAILED}
    line = 1 + SOURCE.split("\n").index('        raise RuntimeError("boom")')
    (said,) = {re.sub(r"\(\S+\.py", "(", answer.reason.partition(";")[0]) for answer in answers}
    assert said == f"RuntimeError: boom (, line {line})"
    boom = answers[0].reason.partition(";")[0]
    assert [answer.reason for answer in answers] == [
        f"{boom}; it last printed: a contact too many",
        f"{boom}; it last printed: overflow",
        boom,
        f"{boom}; it last printed: told from C",
        boom,
        f"{boom}; it last printed: a contact too many",
    ]
