"""The steps that the adviser gives, tried on the engines themselves: by their own interfaces, and judged by hand.

Of each engine stands here what its profile `tuned` says, for two smooth discs of which the second rests.
"""

from __future__ import annotations

import importlib
import math
import warnings
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import pytest

from carom import Scene
from carom.runs.pool import LocalPool
from carom.scenes import find_scenes
from carom.studies.advise.options import AdviceOptions
from carom.studies.advise.run import Advice, advise

Vector = tuple[float, float]

#: A push from so long ago is over: a run goes on for this many steps after the touch.
AFTER = 4


@dataclass(frozen=True)
class Shot:
    """One disc shot at another that rests; velocities are along x.

    Attributes:
        at: Where the shot one is at first.
        target: Where the other one is.
        speed: Of the shot one.
        radii: Of both.
        masses: Of both.
        restitution: Of their impact.
    """

    at: Vector
    target: Vector
    speed: float
    radii: tuple[float, float]
    masses: tuple[float, float]
    restitution: float

    @classmethod
    def of(cls, scene: Scene) -> Shot:
        """Read its numbers off a scene."""
        one, two = scene.discs
        assert one.velocity_m_s[1] == 0.0
        assert two.velocity_m_s == (0.0, 0.0)
        assert one.velocity_m_s[0] > 0.0
        return cls(
            one.position_m,
            two.position_m,
            one.velocity_m_s[0],
            (one.radius_m, two.radius_m),
            (one.mass_kg, two.mass_kg),
            scene.restitution,
        )

    @property
    def touch_s(self) -> float:
        """When they touch."""
        aside = self.target[1] - self.at[1]
        return (self.target[0] - self.at[0] - math.sqrt(sum(self.radii) ** 2 - aside**2)) / self.speed

    @property
    def after(self) -> tuple[Vector, Vector]:
        """Velocities after the impact: the push is along the line of centres."""
        reach, aside = sum(self.radii), self.target[1] - self.at[1]
        normal = (math.sqrt(reach**2 - aside**2) / reach, aside / reach)
        push = (1 + self.restitution) * self.speed * normal[0] / (1 / self.masses[0] + 1 / self.masses[1])
        one, two = push / self.masses[0], push / self.masses[1]
        return ((self.speed - one * normal[0], -one * normal[1]), (two * normal[0], two * normal[1]))

    def begun(self, earlier_s: float) -> Shot:
        """The same, begun so much earlier."""
        at = (self.at[0] - self.speed * earlier_s, self.at[1])
        return Shot(at, self.target, self.speed, self.radii, self.masses, self.restitution)

    def fast(self, dt_s: float) -> bool:
        """Whether the shot one moves by more than its radius in a step: then it is swept."""
        return self.speed * dt_s > self.radii[0]

    def steps(self, dt_s: float) -> int:
        """Steps to some after the touch."""
        return math.ceil(self.touch_s / dt_s) + AFTER


Drive = Callable[[Shot, float], tuple[Vector, Vector]]


def pymunk(shot: Shot, dt_s: float) -> tuple[Vector, Vector]:
    """Velocities after the run."""
    engine: Any = importlib.import_module("pymunk")
    space = engine.Space()
    space.iterations, space.collision_bias = 20, 1.0
    bodies = []
    for at, radius, mass in zip((shot.at, shot.target), shot.radii, shot.masses, strict=True):
        body = engine.Body(mass, math.inf)
        body.position = at
        shape = engine.Circle(body, radius)
        shape.elasticity = math.sqrt(shot.restitution)
        space.add(body, shape)
        bodies.append(body)
    bodies[0].velocity = (shot.speed, 0.0)
    for _ in range(shot.steps(dt_s)):
        space.step(dt_s)
    one, two = bodies
    return (one.velocity.x, one.velocity.y), (two.velocity.x, two.velocity.y)


def box2d(shot: Shot, dt_s: float) -> tuple[Vector, Vector]:
    """The same in a world that runs a million times faster, so that slow contacts bounce, too."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        engine: Any = importlib.import_module("Box2D")
    scale = 2.0**20
    world = engine.b2World(gravity=(0, 0))
    world.continuousPhysics = shot.fast(dt_s)
    bodies = []
    for k, (at, radius, mass) in enumerate(zip((shot.at, shot.target), shot.radii, shot.masses, strict=True)):
        body = world.CreateDynamicBody(
            position=at,
            linearVelocity=(0 if k else shot.speed * scale, 0),
            fixedRotation=True,
            bullet=not k and shot.fast(dt_s),
        )
        body.CreateFixture(
            shape=engine.b2CircleShape(radius=radius), density=1, friction=0, restitution=shot.restitution
        )
        body.massData = engine.b2MassData(mass=mass, center=(0, 0), I=1)
        bodies.append(body)
    for _ in range(shot.steps(dt_s)):
        world.Step(dt_s / scale, 50, 0)
    one, two = ((body.linearVelocity[0] / scale, body.linearVelocity[1] / scale) for body in bodies)
    return one, two


def mujoco(shot: Shot, dt_s: float) -> tuple[Vector, Vector]:
    """The same of spheres on slides, with contacts that one step answers, and speculated on."""
    engine: Any = importlib.import_module("mujoco")
    contact = f'solref="0 {-(1 + shot.restitution) / dt_s!r}" solimp="0.9999 0.9999 0.001 0.5 2" condim="1"'
    slides = '<joint type="slide" axis="1 0 0"/><joint type="slide" axis="0 1 0"/>'
    bodies = "".join(
        f'<body><inertial pos="0 0 0" mass="{mass!r}" diaginertia="1 1 1"/>{slides}'
        f'<geom type="sphere" size="{radius!r}" {contact}/></body>'
        for radius, mass in zip(shot.radii, shot.masses, strict=True)
    )
    model = engine.MjModel.from_xml_string(
        f'<mujoco><option timestep="{dt_s!r}" gravity="0 0 0" integrator="Euler" jacobian="dense" tolerance="0">'
        f'<flag autoreset="disable" speculative="enable"/></option><worldbody>{bodies}</worldbody></mujoco>'
    )
    data = engine.MjData(model)
    data.qpos[:] = (*shot.at, *shot.target)
    data.qvel[:] = (shot.speed, 0, 0, 0)
    for _ in range(shot.steps(dt_s)):
        engine.mj_step(model, data)
    a, b, c, d = data.qvel.tolist()
    return (a, b), (c, d)


def pybullet(shot: Shot, dt_s: float) -> tuple[Vector, Vector]:
    """The same of spheres; one that is fast is swept."""
    engine: Any = importlib.import_module("pybullet")
    client = engine.connect(engine.DIRECT)
    try:
        engine.setPhysicsEngineParameter(
            fixedTimeStep=dt_s,
            contactERP=0,
            contactSlop=0,
            restitutionVelocityThreshold=0,
            solverResidualThreshold=0,
            numSolverIterations=50,
            deterministicOverlappingPairs=1,
            physicsClientId=client,
        )
        bodies = []
        for k, (at, radius, mass) in enumerate(zip((shot.at, shot.target), shot.radii, shot.masses, strict=True)):
            shape = engine.createCollisionShape(engine.GEOM_SPHERE, radius=radius, physicsClientId=client)
            body = engine.createMultiBody(
                mass, shape, basePosition=[*at, 0], useMaximalCoordinates=True, physicsClientId=client
            )
            engine.changeDynamics(
                body,
                -1,
                restitution=math.sqrt(shot.restitution),
                lateralFriction=0,
                linearDamping=0,
                contactProcessingThreshold=0,
                ccdSweptSphereRadius=0.95 * radius if not k and shot.fast(dt_s) else 0,
                physicsClientId=client,
            )
            bodies.append(body)
        engine.resetBaseVelocity(bodies[0], [shot.speed, 0, 0], [0, 0, 0], client)
        for _ in range(shot.steps(dt_s)):
            engine.stepSimulation(client)
        (a, b, _), (c, d, _) = (engine.getBaseVelocity(body, client)[0] for body in bodies)
        return (a, b), (c, d)
    finally:
        engine.disconnect(client)


DRIVES: dict[str, Drive] = {"pymunk": pymunk, "box2d": box2d, "mujoco": mujoco, "pybullet": pybullet}


def judged(drive: Drive, shot: Shot, dt_s: float) -> Iterator[tuple[bool, float]]:
    """Whether it hits, and its direction error: at 64 starts over a step, and where a look is just before the touch."""
    for phase in (*(k / 64 for k in range(64)), (1e-3 - shot.touch_s / dt_s) % 1.0):
        begun = shot.begun(phase * dt_s)
        found = drive(begun, dt_s)
        hit = found[1] != (0.0, 0.0)
        wrong = [
            abs(math.atan2(a * d - b * c, a * c + b * d)) for (a, b), (c, d) in zip(found, begun.after, strict=True)
        ]
        yield hit, max(wrong) if hit else math.nan


def puck() -> Scene:
    """A puck of 3 cm at 20 m/s that another one of its kind stands in the way of, a third of a radius aside."""
    discs = [
        {"position_m": (0.0, 0.0), "velocity_m_s": (20.0, 0.0), "radius_m": 0.03},
        {"position_m": (2.0, 0.01), "radius_m": 0.03},
    ]
    return Scene(name="puck", discs=discs, duration_s=0.2)


CASES: dict[str, tuple[Callable[[], Scene], float]] = {
    "bullet": (lambda: find_scenes(["classics/bullet"])[0].scene, 5.0),
    "graze": (lambda: find_scenes(["classics/graze"])[0].scene, 2.0),
    "puck": (puck, 1.0),
}


@pytest.fixture(scope="module", params=CASES)
def advised(request: pytest.FixtureRequest) -> tuple[str, Advice]:
    """What the adviser says of a scene, of the engines that are there."""
    make, degrees = CASES[request.param]
    with LocalPool() as pool:
        return request.param, advise(
            make(), AdviceOptions(list(DRIVES), profiles=["tuned"], direction_error_rad=math.radians(degrees)), pool
        )


@pytest.mark.long
@pytest.mark.parametrize("engine", DRIVES)
def test_a_bare_engine_passes_at_the_step_advised_and_fails_at_the_next(
    advised: tuple[str, Advice], engine: str
) -> None:
    """At 65 starts it always hits, and meets the demand; at the step said to fail at one of them it does not."""
    name, advice = advised
    answer = next((found for found in advice.answers if found.method.engine == engine), None)
    if answer is None:
        pytest.skip(f"{engine} is not installed")
    shot, angle = Shot.of(advice.scene), advice.demand.direction_error_rad
    for found, wholly in ((answer.never_misses, False), (answer.demand, True)):
        assert found.passes is not None, name
        tried = list(judged(DRIVES[engine], shot, found.passes.dt_s))
        assert len(tried) == 65
        assert all(hit for hit, _ in tried)
        assert all(wrong <= angle for _, wrong in tried) or not wholly
        if found.fails is not None:
            tried = list(judged(DRIVES[engine], shot, found.fails.dt_s))
            assert not all(hit and (wrong <= angle or not wholly) for hit, wrong in tried)


@pytest.mark.long
def test_engines_that_sweep_need_few_steps_and_those_that_look_need_what_pit_needs(
    advised: tuple[str, Advice],
) -> None:
    """Of the bullet 60 steps a second are enough for Box2D and MuJoCo, 15 for PyBullet, and 30 of the puck.

    Pymunk needs what PIT needs: what checks once per step passes at or below the closed form only, and no more than one
    step of the grid below it.
    """
    name, advice = advised
    found = {answer.method.engine: answer for answer in advice.answers}
    most = {("bullet", "box2d"): 60, ("bullet", "mujoco"): 60, ("bullet", "pybullet"): 15, ("puck", "pybullet"): 30}
    for engine, answer in found.items():
        assert answer.demand.passes is not None
        assert 1 / answer.demand.passes.dt_s <= most.get((name, engine), math.inf) * (1 + 1e-9)
    if "pymunk" not in found:
        pytest.skip("pymunk is not installed")
    looks, closed = found["pymunk"], advice.closed_form
    assert closed is not None
    for passes, closed_s in (
        (looks.never_misses.passes, closed.never_misses_s),
        (looks.demand.passes, closed.demand_s),
    ):
        assert passes is not None
        assert closed_s / 1.5 < passes.dt_s <= closed_s
