"""One disc that hits a level floor, in each engine by its own interface, without adapters and Carom.

It has radius 1/2, mass 1 and inertia 1/8 by default. The first step with an overlap at its end ends `LATE` of a step
after the touch, to which an arm that the overlap shortens is whole.
"""

import importlib
import warnings
from dataclasses import dataclass
from typing import Any

RADIUS_M = 0.5
DT_S = 1 / 240
LATE = 1e-6

#: Steps to the one that ends with an overlap, and a few in which the bodies part.
STEPS = 6


@dataclass(frozen=True)
class Thrown:
    """A disc and what it is thrown at.

    Attributes:
        velocity: Metres per second.
        spin: Radians per second, counterclockwise.
        friction: Coefficients given to the disc and to the floor, as the engine takes them.
        restitution: Coefficient given to both, so that the engine's own rule makes it `restitution` again.
        restitutions: Coefficients given to the disc and to the floor instead.
        inertia: Moment of inertia, kg m^2; None leaves it as shipped.
        steps_before: Steps before the touch.
        late: By how much of a step the step that ends with an overlap ends after the touch.
    """

    velocity: tuple[float, float] = (2.0, -3.0)
    spin: float = 0.0
    friction: tuple[float, float] = (0.1, 0.1)
    restitution: float = 1.0
    restitutions: tuple[float, float] | None = None
    inertia: float | None = 0.125
    steps_before: float = 1.0
    late: float = LATE

    def list_coefficients(self, own: float) -> list[tuple[float, float]]:
        """Return friction and restitution of the disc and of the floor, `own` being what gives `restitution` again."""
        return list(zip(self.friction, self.restitutions or (own, own), strict=True))

    @property
    def height_m(self) -> float:
        """Height of the centre over the floor at the start."""
        return RADIUS_M - self.velocity[1] * DT_S * (self.steps_before - self.late)


Left = tuple[float, float, float]


def pymunk(thrown: Thrown) -> Left:
    """Return velocity and spin after the impact."""
    import pymunk as engine

    space = engine.Space()
    body = engine.Body(1.0, thrown.inertia or engine.moment_for_circle(1.0, 0.0, RADIUS_M))
    body.position, body.velocity, body.angular_velocity = (0, thrown.height_m), thrown.velocity, thrown.spin
    floor = engine.Body(body_type=engine.Body.STATIC)
    shapes = (engine.Circle(body, RADIUS_M), engine.Poly(floor, [(-9, -9), (9, -9), (9, 0), (-9, 0)]))
    for shape, (friction, restitution) in zip(shapes, thrown.list_coefficients(thrown.restitution**0.5), strict=True):
        shape.elasticity, shape.friction = restitution, friction
    space.add(body, floor, *shapes)
    for _ in range(STEPS):
        space.step(DT_S)
    return (body.velocity.x, body.velocity.y, body.angular_velocity)


def box2d(thrown: Thrown, iterations: int = 50, velocity_scale: float = 2.0**20) -> Left:
    """Return velocity and spin after the impact, in a world that runs `velocity_scale` times faster, without skins."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        engine: Any = importlib.import_module("Box2D")
    world = engine.b2World(gravity=(0, 0))
    body = world.CreateDynamicBody(
        position=(0, thrown.height_m),
        linearVelocity=[v * velocity_scale for v in thrown.velocity],
        angularVelocity=thrown.spin * velocity_scale,
        allowSleep=False,
    )
    slab = engine.b2PolygonShape(vertices=[(-9, -9), (9, -9), (9, 0), (-9, 0)])
    slab.radius = 0.0
    floor = world.CreateStaticBody(position=(0, 0))
    shapes = ((body, engine.b2CircleShape(radius=RADIUS_M)), (floor, slab))
    for (of, shape), (friction, restitution) in zip(shapes, thrown.list_coefficients(thrown.restitution), strict=True):
        of.CreateFixture(shape=shape, density=1, friction=friction, restitution=restitution)
    body.massData = engine.b2MassData(mass=1, center=(0, 0), I=thrown.inertia or 0.125)
    for _ in range(STEPS):
        world.Step(DT_S / velocity_scale, iterations, 0)
    x, y = body.linearVelocity
    return (x / velocity_scale, y / velocity_scale, body.angularVelocity / velocity_scale)


def pybullet(thrown: Thrown, *, maximal: bool = True, planar: bool = False, **dynamics: float) -> Left:
    """Return velocity and spin after the impact; `planar` gives the inertia about the axis of spin alone."""
    engine: Any = importlib.import_module("pybullet")
    client = engine.connect(engine.DIRECT)
    try:
        engine.setPhysicsEngineParameter(
            fixedTimeStep=DT_S, contactERP=0, restitutionVelocityThreshold=0, contactSlop=0, physicsClientId=client
        )
        ball = engine.createCollisionShape(engine.GEOM_SPHERE, radius=RADIUS_M, physicsClientId=client)
        plane = engine.createCollisionShape(engine.GEOM_PLANE, planeNormal=[0, 1, 0], physicsClientId=client)
        bodies = [
            engine.createMultiBody(
                mass, shape, basePosition=[0, y, 0], useMaximalCoordinates=maximal, physicsClientId=client
            )
            for mass, shape, y in ((1, ball, thrown.height_m), (0, plane, 0))
        ]
        told: dict[str, Any] = {"linearDamping": 0, "angularDamping": 0, "contactProcessingThreshold": 0, **dynamics}
        if thrown.inertia is not None:
            told["mass"] = 1
            told["localInertiaDiagonal"] = [0 if planar else thrown.inertia] * 2 + [thrown.inertia]
        given = thrown.list_coefficients(thrown.restitution**0.5)
        for body, more, (friction, restitution) in zip(
            bodies, (told, {"contactProcessingThreshold": 0}), given, strict=True
        ):
            engine.changeDynamics(
                body, -1, restitution=restitution, lateralFriction=friction, physicsClientId=client, **more
            )
        engine.resetBaseVelocity(bodies[0], [*thrown.velocity, 0], [0, 0, thrown.spin], client)
        for _ in range(STEPS):
            engine.stepSimulation(client)
        (x, y, _), (_, _, spin) = engine.getBaseVelocity(bodies[0], client)
        return (x, y, spin)
    finally:
        engine.disconnect(client)


def mujoco(thrown: Thrown, option: str = 'cone="elliptic"', pair: str = "", mass: float = 1.0) -> Left:
    """Return velocity and spin after the impact, answered in one step by damping; `pair` lists it as a pair, with that.

    Where it is no pair, MuJoCo combines the two coefficients by its own rule. Inertia goes with `mass`.
    """
    engine: Any = importlib.import_module("mujoco")
    contact = f'solref="0 {-(1 + thrown.restitution) / DT_S!r}" solimp="0.9999 0.9999 0.001 0.5 2" condim="3"'
    alone = 'contype="0" conaffinity="0"' if pair else ""
    inertia = mass * (thrown.inertia or 0.1)
    disc, floor = thrown.friction
    listed = f"<contact><pair geom1='disc' geom2='floor' {contact} {pair}/></contact>" if pair else ""
    joints = "".join(f'<joint type="slide" axis="{axis}"/>' for axis in ("1 0 0", "0 1 0", "0 0 1"))
    model = engine.MjModel.from_xml_string(
        f'<mujoco><option timestep="{DT_S!r}" gravity="0 0 0" tolerance="0" jacobian="dense" {option}>'
        f'<flag warmstart="disable"/></option><worldbody>'
        f'<body pos="0 {thrown.height_m!r} 0">{joints}<joint type="hinge" axis="0 0 1"/>'
        f'<inertial pos="0 0 0" mass="{mass!r}" diaginertia="{inertia!r} {inertia!r} {inertia!r}"/>'
        f'<geom name="disc" type="sphere" size="{RADIUS_M}" friction="{disc!r} 0 0" {alone} {contact}/></body>'
        f'<geom name="floor" type="plane" size="0 0 1" zaxis="0 1 0" friction="{floor!r} 0 0" {alone} {contact}/>'
        f"</worldbody>{listed}</mujoco>"
    )
    data = engine.MjData(model)
    data.qvel[:] = (*thrown.velocity, 0, thrown.spin)
    for _ in range(STEPS):
        engine.mj_step(model, data)
    x, y, _, spin = data.qvel.tolist()
    return (x, y, spin)
