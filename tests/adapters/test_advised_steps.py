"""The steps that the adviser gives, tried on the engines themselves: by their own interfaces, and scored by hand."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
import pytest
from numpy.typing import NDArray
from tests.adapters.bare_runs import ENGINES, Body, Stage, Vector
from tests.cases import each
from tests.scene_builders import disc_at, require_value, staged

from carom import Scene
from carom.catalogue import find_scenes
from carom.execution.pool import LocalPool
from carom.studies.advise.options import AdviceOptions
from carom.studies.advise.run import Advice, advise

#: A push from so long ago is over: a run goes on for this many steps after the touch.
AFTER = 4

NAMES = ("pymunk", "box2d", "mujoco", "pybullet")


@dataclass(frozen=True)
class Shot:
    """One disc shot along x at another that rests, with the restitution of their impact."""

    shot: Body
    target: Body
    restitution: float

    @classmethod
    def of(cls, scene: Scene) -> Shot:
        """Read its numbers off a scene."""
        one, two = (Body(disc.position_m, disc.velocity_m_s, disc.radius_m, disc.mass_kg) for disc in scene.discs)
        assert one.velocity[1] == 0.0
        assert two.velocity == (0.0, 0.0)
        assert one.velocity[0] > 0.0
        return cls(one, two, scene.restitution)

    @property
    def offset(self) -> tuple[float, float]:
        """From one centre to the other where they touch."""
        aside = self.target.place[1] - self.shot.place[1]
        return math.sqrt((self.shot.radius + self.target.radius) ** 2 - aside**2), aside

    @property
    def touch_s(self) -> float:
        """When they touch."""
        return (self.target.place[0] - self.shot.place[0] - self.offset[0]) / self.shot.velocity[0]

    @property
    def after(self) -> tuple[Vector, Vector]:
        """Velocities after the impact: the push is along the line of centres."""
        reach, speed = math.hypot(*self.offset), self.shot.velocity[0]
        normal = (self.offset[0] / reach, self.offset[1] / reach)
        push = (1 + self.restitution) * speed * normal[0] / (1 / self.shot.mass + 1 / self.target.mass)
        one, two = push / self.shot.mass, push / self.target.mass
        return ((speed - one * normal[0], -one * normal[1]), (two * normal[0], two * normal[1]))

    def run(self, engine: str, dt_s: float, earlier_s: float) -> NDArray[np.float64]:
        """Return the final velocities of a tuned engine for an earlier start of the shot."""
        x, y = self.shot.place
        begun = replace(self.shot, place=(x - self.shot.velocity[0] * earlier_s, y))
        stage = Stage((begun, self.target), (), self.restitution, self.restitution, (0.0, 0.0))
        steps = math.ceil((self.touch_s + earlier_s) / dt_s) + AFTER
        return ENGINES[engine](stage, "tuned", dt_s, steps)[-1, :, 2:4]


def score_phases(engine: str, shot: Shot, dt_s: float) -> Iterator[tuple[bool, float]]:
    """Whether it hits, and its direction error: at 64 starts over a step, and where a look is just before the touch."""
    for phase in (*(k / 64 for k in range(64)), (1e-3 - shot.touch_s / dt_s) % 1.0):
        found = shot.run(engine, dt_s, phase * dt_s)
        hit = bool(found[1].any())
        turns = zip(found, shot.after, strict=True)
        wrong = [abs(math.atan2(a * d - b * c, a * c + b * d)) for (a, b), (c, d) in turns]
        yield hit, max(wrong) if hit else math.nan


PUCKS = staged("puck", disc_at(0.0, 0.0, 20.0, r=0.03), disc_at(2.0, 0.01, r=0.03), duration_s=0.2)


#: By name: a scene, in the last with pucks of 3 cm a third of a radius aside, and the demanded direction in degrees.
CASES: dict[str, tuple[Scene, float]] = {
    "bullet": (find_scenes(["classics/bullet"])[0].scene, 5.0),
    "graze": (find_scenes(["classics/graze"])[0].scene, 2.0),
    "puck": (PUCKS, 1.0),
}


@pytest.fixture(scope="module", params=CASES)
def advice_of_scene(request: pytest.FixtureRequest) -> tuple[str, Advice]:
    """What the adviser says of a scene, of the engines that are there."""
    scene, degrees = CASES[request.param]
    asked = AdviceOptions(list(NAMES), profiles=["tuned"], direction_error_rad=math.radians(degrees))
    with LocalPool() as pool:
        return request.param, advise(scene, asked, pool)


@pytest.mark.long
@each("engine", NAMES)
def test_advised_steps_hold_in_bare_engines(advice_of_scene: tuple[str, Advice], engine: str) -> None:
    """At advised steps a bare engine meets the demand from all 65 starts, and at the failing step it does not."""
    name, advice = advice_of_scene
    answer = next((found for found in advice.answers if found.method.engine == engine), None)
    if answer is None:
        pytest.skip(f"{engine} is not installed")
    shot, angle = Shot.of(advice.scene), advice.target.direction_error_rad
    for found, wholly in ((answer.never_misses, False), (answer.meets_target, True)):
        assert found.largest_passing is not None, name
        tried = list(score_phases(engine, shot, found.largest_passing.dt_s))
        assert len(tried) == 65
        assert all(hit for hit, _ in tried)
        assert all(wrong <= angle for _, wrong in tried) or not wholly
        if found.smallest_failing is not None:
            tried = list(score_phases(engine, shot, found.smallest_failing.dt_s))
            assert not all(hit and (wrong <= angle or not wholly) for hit, wrong in tried)


@pytest.mark.long
def test_swept_engines_need_few_steps_and_pymunk_those_of_pit(advice_of_scene: tuple[str, Advice]) -> None:
    """For bullet and puck swept engines need 15 to 60 steps per second, pymunk those of PIT's closed form."""
    name, advice = advice_of_scene
    found = {answer.method.engine: answer for answer in advice.answers}
    most = {("bullet", "box2d"): 60, ("bullet", "mujoco"): 60, ("bullet", "pybullet"): 15, ("puck", "pybullet"): 30}
    for engine, answer in found.items():
        assert 1 / require_value(answer.meets_target.largest_passing).dt_s <= most.get((name, engine), math.inf) * (
            1 + 1e-9
        )
    if "pymunk" not in found:
        pytest.skip("pymunk is not installed")
    looks, closed = found["pymunk"], require_value(advice.closed_form)
    for steps, closed_s in ((looks.never_misses, closed.never_misses_s), (looks.meets_target, closed.meets_target_s)):
        assert closed_s / 1.5 < require_value(steps.largest_passing).dt_s <= closed_s
