"""Small cross-checks built by hand: real traces of PIC and PIT, and an engine for every reason not to run."""

from collections.abc import Mapping
from dataclasses import replace

import pytest
from tests.scene_builders import disc_at, staged, wall_at

from carom.catalogue import KnownAnswer
from carom.comparator import compare
from carom.engines.registry import EngineInfo, load_adapter
from carom.execution.environment import Environment
from carom.execution.job import Job, Method, Status
from carom.execution.observation.engine_run import observe_run
from carom.execution.results import Results, Row
from carom.execution.timing import Timing
from carom.model.scene import Scene
from carom.model.trace import Trace
from carom.solvers.pic import solve_pic

#: A name that would be markup, a table border, a formula and a link in whatever does not escape it.
NASTY = 'mine/<script>alert("1")</script>|$x$ [a](b) & `c`'

NOT_RUN = {
    "gone": (Status.UNAVAILABLE, "gone is not installed; pip install 'gone'"),
    "limited": (Status.UNSUPPORTED, "the scene has walls, which this method does not support"),
    "broken": (Status.CRASHED, "ended by signal 11\x1b[31m & <nothing> more"),
    "slow": (Status.TIMED_OUT, "no answer in 60 s"),
    "odd": (Status.FAILED, "ZeroDivisionError: inertia"),
}


@pytest.fixture(scope="session")
def nasty() -> str:
    """The name that must be escaped everywhere."""
    return NASTY


@pytest.fixture(scope="session")
def not_run() -> Mapping[str, tuple[Status, str]]:
    """Status and reason of each engine that was not run."""
    return NOT_RUN


def _scenes() -> list[Scene]:
    oblique = [disc_at(-1.0, 0.0, 3.0, 0.2, r=0.3), disc_at(1.0, 0.2, -2.0, 0.0, r=0.3)]
    # At 5 frames per second the discs pass through each other between two frames: PIT misses the impact.
    missed = [disc_at(-1.0, 0.0, 10.0, 0.0, r=0.1), disc_at(0.0, 0.1, r=0.1)]
    head_on = [disc_at(-1.0, 0.0, 1.0, 0.0, r=0.25), disc_at(0.5, 0.0, r=0.25)]
    wall = wall_at(1.0, 0.0, -1.0, 0.0)
    return [
        staged("paper/late", *oblique, description="Late.", duration_s=1.0, frame_rate_hz=24.0),
        staged("paper/missed", *missed, description="Missed.", duration_s=1.0, frame_rate_hz=5.0),
        staged(NASTY, *head_on, wall, description="<b>bold</b>", duration_s=2.0, frame_rate_hz=24.0),
    ]


def _info(name: str, engine: str, profiles: Mapping[str, str]) -> EngineInfo:
    return EngineInfo(name, engine, "1.0", "", None, profiles, "carom")


@pytest.fixture(scope="session")
def results() -> Results:
    """Three scenes, two steps: PIC, PIT, PIT under the name of a foreign engine, and five engines that were not run."""
    rows: list[Row] = []
    references: dict[str, Trace] = {}
    for scene in _scenes():
        reference = references[scene.name] = solve_pic(scene)
        for refinement, dt_s in enumerate((1.0 / scene.frame_rate_hz, 1.0 / (4.0 * scene.frame_rate_hz))):
            pit = observe_run(load_adapter("pit"), scene, "tuned", dt_s, samples=refinement == 0)
            pic = observe_run(load_adapter("pic"), scene, "tuned", dt_s, samples=refinement == 0)
            ran = {"pic": pic, "pit": pit, "toy": replace(pit, method="toy")}
            for engine, trace in ran.items():
                cell = Job(scene, Method(engine, "tuned"), dt_s, refinement)
                score = compare(reference, trace, sampling=pit)
                ratio = 0.5 if engine == "toy" else 1.0
                rows.append(Row(cell, Status.RAN, "", trace, score, Timing(1e-3, ratio * 1e-2, 3), ratio))
            for engine, (status, reason) in NOT_RUN.items():
                rows.append(Row(Job(scene, Method(engine, "tuned"), dt_s, refinement), status, reason))
    infos = [_info("pic", "Carom", {"tuned": "Event-driven."}), _info("pit", "Carom", {"tuned": "Algorithm 1."})]
    infos += [_info(name, name.title(), {"tuned": "As it comes."}) for name in ("toy", *NOT_RUN)]
    return Results(
        rows=tuple(rows),
        references=references,
        known={name: (KnownAnswer(source=f"A closed form for {name}"), 2.5e-15) for name in references},
        engines=tuple(infos),
        environment=Environment("2026-01-02T03:04:05+00:00", "0.1.0", "CPython 3.11", "Linux", "A <CPU>", 2, {}),
        command="carom run --report 'a & b'",
        elapsed_s=12.5,
    )
