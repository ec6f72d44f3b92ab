"""Flights of one disc at walls in engines with Python interfaces, for `walls.py`, without adapters.

``python docs/figures/walls_python.py ENGINE WAY`` reads flights as JSON from standard input, and writes the final state
of each flight as JSON. All settings are the shipped ones, except restitution 1, no friction, no damping and no sleep.
MuJoCo has no restitution, so its contacts end in one step instead.
"""

from __future__ import annotations

import json
import math
import sys
from collections.abc import Callable
from itertools import pairwise
from typing import Any

Flight = dict[str, Any]
End = list[float]

#: Engines need a mass. The value of the mass has no effect in an impact with a wall.
MASS_KG = 1.0


def pymunk(way: str, flight: Flight) -> End:
    """pymunk: segments, with or without `set_neighbors`."""
    import pymunk

    space, body = pymunk.Space(), pymunk.Body(MASS_KG, math.inf)
    body.position, body.velocity = flight["position_m"], flight["velocity_m_s"]
    shapes: list[pymunk.Shape] = [pymunk.Circle(body, flight["radius_m"])]
    points = [tuple(point) for point in flight["points_m"]]
    for k, (a, b) in enumerate(pairwise(points)):
        segment = pymunk.Segment(space.static_body, a, b, flight["half_width_m"])
        if way == "neighbours":
            segment.set_neighbors(points[max(k - 1, 0)], points[min(k + 2, len(points) - 1)])
        shapes.append(segment)
    for shape in shapes:
        shape.elasticity = 1.0
    space.add(body, *shapes)
    for _ in range(flight["steps"]):
        space.step(flight["dt_s"])
    return [*body.position, *body.velocity]


def box2d(way: str, flight: Flight) -> End:
    """Box2D: edges, or one chain."""
    import Box2D

    world = Box2D.b2World(gravity=(0, 0))
    radius, points = flight["radius_m"], [tuple(point) for point in flight["points_m"]]
    body = world.CreateDynamicBody(
        position=flight["position_m"], linearVelocity=flight["velocity_m_s"], fixedRotation=True, allowSleep=False
    )
    circle = Box2D.b2CircleShape(radius=radius)
    body.CreateFixture(shape=circle, density=MASS_KG / (math.pi * radius**2), restitution=1, friction=0)
    edges = [Box2D.b2EdgeShape(vertices=pair) for pair in pairwise(points)]
    wall = world.CreateStaticBody()
    for shape in [Box2D.b2ChainShape(vertices_chain=points)] if way == "chain" else edges:
        wall.CreateFixture(shape=shape, restitution=1, friction=0)
    for _ in range(flight["steps"]):
        world.Step(flight["dt_s"], 8, 3)  # Box2D's manual suggests 8 velocity and 3 position iterations.
    return [*body.position, *body.linearVelocity]


def mujoco(way: str, flight: Flight) -> End:
    """MuJoCo: boxes or capsules."""
    import mujoco

    half, (x, y), dt = flight["half_width_m"], flight["position_m"], flight["dt_s"]
    geoms = ""
    for (ax, ay), (bx, by) in pairwise(flight["points_m"]):
        turned = math.degrees(math.atan2(by - ay, bx - ax))
        geoms += (
            f'<geom type="capsule" fromto="{ax} {ay} 0 {bx} {by} 0" size="{half}"/>'
            if way == "capsules"
            else f'<geom type="box" pos="{(ax + bx) / 2} {(ay + by) / 2} 0" euler="0 0 {turned}" '
            f'size="{math.hypot(bx - ax, by - ay) / 2} {half} 1"/>'
        )
    model = mujoco.MjModel.from_xml_string(
        f'<mujoco><option timestep="{dt}" gravity="0 0 0"/><default><geom solref="0 {-2 / dt}" '
        f'solimp=".9999 .9999 .001" friction="0 0 0" condim="1"/></default><worldbody>{geoms}<body pos="{x} {y} 0">'
        '<joint type="slide" axis="1 0 0"/><joint type="slide" axis="0 1 0"/>'
        f'<geom type="sphere" size="{flight["radius_m"]}" mass="{MASS_KG}"/></body></worldbody></mujoco>'
    )
    data = mujoco.MjData(model)
    data.qvel[:] = flight["velocity_m_s"]
    for _ in range(flight["steps"]):
        mujoco.mj_step(model, data)
    return [x + data.qpos[0], y + data.qpos[1], *data.qvel.tolist()]


def pybullet(way: str, flight: Flight) -> End:
    """PyBullet: boxes or capsules; the disc may have a swept sphere and maximal coordinates."""
    import pybullet as p

    client = p.connect(p.DIRECT)
    p.setTimeStep(flight["dt_s"], physicsClientId=client)

    def add(shape: int, mass: float, position: list[float], turned: float = 0.0, **more: float) -> int:
        facing = p.getQuaternionFromEuler([0, 0, turned])
        of = {"useMaximalCoordinates": int("maximal" in way), "physicsClientId": client}
        body: int = p.createMultiBody(mass, shape, -1, [*position, 0], facing, **of)
        set_up = {"restitution": 1, "lateralFriction": 0, "linearDamping": 0, "angularDamping": 0}
        p.changeDynamics(body, -1, **set_up, **more, physicsClientId=client)
        return body

    for (ax, ay), (bx, by) in pairwise(flight["points_m"]):
        size = [math.hypot(bx - ax, by - ay) / 2, flight["half_width_m"], 1]
        if way == "capsules":  # The capsule must be along x, but its default axis is z.
            lying = p.getQuaternionFromEuler([0, math.pi / 2, 0])
            of = {"radius": size[1], "height": 2 * size[0], "collisionFrameOrientation": lying}
            shape = p.createCollisionShape(p.GEOM_CAPSULE, **of, physicsClientId=client)
        else:
            shape = p.createCollisionShape(p.GEOM_BOX, halfExtents=size, physicsClientId=client)
        add(shape, 0.0, [(ax + bx) / 2, (ay + by) / 2], math.atan2(by - ay, bx - ax))
    sphere = p.createCollisionShape(p.GEOM_SPHERE, radius=flight["radius_m"], physicsClientId=client)
    swept = {"ccdSweptSphereRadius": flight["radius_m"] / 2} if "swept" in way else {}
    disc = add(sphere, MASS_KG, flight["position_m"], **swept)
    p.resetBaseVelocity(disc, [*flight["velocity_m_s"], 0], [0, 0, 0], physicsClientId=client)
    for _ in range(flight["steps"]):
        p.stepSimulation(physicsClientId=client)
    x, y, _ = p.getBasePositionAndOrientation(disc, physicsClientId=client)[0]
    vx, vy, _ = p.getBaseVelocity(disc, physicsClientId=client)[0]
    p.disconnect(client)
    return [x, y, vx, vy]


def dart(way: str, flight: Flight) -> End:
    """DART: boxes or capsules."""
    import dartpy
    import numpy as np

    world = dartpy.simulation.World()
    world.setGravity([0, 0, 0])
    world.setTimeStep(flight["dt_s"])

    def add(body: Any, shape: Any) -> None:
        node = body.createShapeNode(shape)
        node.createCollisionAspect()
        node.createDynamicsAspect()
        node.getDynamicsAspect().setRestitutionCoeff(1.0)
        node.getDynamicsAspect().setFrictionCoeff(0.0)

    for k, ((ax, ay), (bx, by)) in enumerate(pairwise(flight["points_m"])):
        length, half = math.hypot(bx - ax, by - ay), flight["half_width_m"]
        # The axis of a capsule is z, so a box also has its length along z here.
        shapes = dartpy.dynamics
        shape = shapes.CapsuleShape(half, length) if way == "capsules" else shapes.BoxShape([2 * half, 2, length])
        skeleton = dartpy.dynamics.Skeleton(f"piece {k}")
        joint, body = skeleton.createWeldJointAndBodyNodePair()
        pose = np.eye(4)
        x, y = (bx - ax) / length, (by - ay) / length
        pose[:3, :3] = np.column_stack([(-y, x, 0), (0, 0, 1), (x, y, 0)])
        pose[:2, 3] = (ax + bx) / 2, (ay + by) / 2
        placed = dartpy.math.Isometry3()
        placed.set_rotation(pose[:3, :3])
        placed.set_translation(pose[:3, 3])
        joint.setTransformFromParentBodyNode(placed)
        add(body, shape)
        skeleton.setMobile(False)
        world.addSkeleton(skeleton)
    disc = dartpy.dynamics.Skeleton("disc")
    _, body = disc.createTranslationalJoint2DAndBodyNodePair()
    add(body, dartpy.dynamics.SphereShape(flight["radius_m"]))
    body.setMass(MASS_KG)
    world.addSkeleton(disc)
    disc.setPositions(flight["position_m"])
    disc.setVelocities(flight["velocity_m_s"])
    for _ in range(flight["steps"]):
        world.step()
    return [*map(float, disc.getPositions()), *map(float, disc.getVelocities())]


def drake(way: str, flight: Flight) -> End:
    """Drake: boxes or capsules, in a continuous plant, because a discrete plant has no bounce."""
    import logging

    from pydrake import geometry
    from pydrake import math as poses
    from pydrake.multibody import plant as plants
    from pydrake.multibody import tree
    from pydrake.systems import analysis, framework

    logging.getLogger("drake").setLevel(logging.ERROR)
    builder = framework.DiagramBuilder()
    plant, _ = plants.AddMultibodyPlant(plants.MultibodyPlantConfig(time_step=0.0), builder)
    plant.mutable_gravity_field().set_gravity_vector([0.0, 0.0, 0.0])

    def add(body: Any, pose: Any, shape: Any) -> None:
        properties = geometry.ProximityProperties()
        geometry.AddContactMaterial(dissipation=0.0, friction=plants.CoulombFriction(0.0, 0.0), properties=properties)
        plant.RegisterCollisionGeometry(body, pose, shape, f"shape {plant.num_collision_geometries()}", properties)

    for (ax, ay), (bx, by) in pairwise(flight["points_m"]):
        length, half = math.hypot(bx - ax, by - ay), flight["half_width_m"]
        shape = geometry.Capsule(half, length) if way == "capsules" else geometry.Box(2 * half, 2, length)
        facing = poses.RotationMatrix.MakeFromOneVector([(bx - ax) / length, (by - ay) / length, 0.0], 2)
        if way != "capsules":  # The width of a box must be in the plane, at right angles to the piece.
            x, y = (bx - ax) / length, (by - ay) / length
            facing = poses.RotationMatrix([[-y, 0.0, x], [x, 0.0, y], [0.0, 1.0, 0.0]])
        add(plant.world_body(), poses.RigidTransform(facing, [(ax + bx) / 2, (ay + by) / 2, 0.0]), shape)
    radius = flight["radius_m"]
    body = plant.AddRigidBody("disc", tree.SpatialInertia.SolidSphereWithMass(MASS_KG, radius))
    add(body, poses.RigidTransform(), geometry.Sphere(radius))
    frames = plant.world_body().body_frame(), body.body_frame()
    joint = plant.AddJoint(tree.PlanarJoint("plane", *frames, damping=[0, 0, 0]))
    plant.Finalize()
    simulator = analysis.Simulator(builder.Build())
    context = plant.GetMyMutableContextFromRoot(simulator.get_mutable_context())
    joint.set_translation(context, flight["position_m"])
    joint.set_translational_velocity(context, flight["velocity_m_s"])
    simulator.Initialize()
    simulator.AdvanceTo(flight["steps"] * flight["dt_s"])
    return [*joint.get_translation(context).tolist(), *joint.get_translational_velocity(context).tolist()]


def ode(way: str, flight: Flight) -> End:
    """ODE: boxes or capsules, in Panda3D's build of the engine."""
    from panda3d import core, ode

    world, space, group = ode.OdeWorld(), ode.OdeHashSpace(), ode.OdeJointGroup()
    world.setGravity(0, 0, 0)
    for (ax, ay), (bx, by) in pairwise(flight["points_m"]):
        length, half = math.hypot(bx - ax, by - ay), flight["half_width_m"]
        capsule = way == "capsules"  # The axis of a capsule is z, so a box also has its length along z here.
        piece = (
            ode.OdeCappedCylinderGeom(space, half, length) if capsule else ode.OdeBoxGeom(space, 2 * half, 2, length)
        )
        x, y = (bx - ax) / length, (by - ay) / length
        # The columns of the matrix are the images of x, y and z.
        piece.setRotation(core.LMatrix3f(-y, 0, x, x, 0, y, 0, 1, 0))
        piece.setPosition((ax + bx) / 2, (ay + by) / 2, 0)
    ball, body, mass = ode.OdeSphereGeom(space, flight["radius_m"]), ode.OdeBody(world), ode.OdeMass()
    mass.setSphereTotal(MASS_KG, flight["radius_m"])
    body.setMass(mass)
    ball.setBody(body)
    body.setPosition(*flight["position_m"], 0)
    body.setLinearVel(*flight["velocity_m_s"], 0)
    surface = ode.OdeSurfaceParameters()
    surface.setMode(ode.OdeSurfaceParameters.MFContactBounce)
    surface.setBounce(1.0)

    def near(_: Any, first: Any, second: Any) -> None:
        if not first.hasBody() and not second.hasBody():
            return
        found = ode.OdeUtil.collide(first, second, 1)
        for k in range(found.getNumContacts()):
            contact = ode.OdeContact()
            contact.setGeom(found.getContactGeom(k))
            contact.setSurface(surface)
            ode.OdeContactJoint(world, group, contact).attach(first.getBody(), second.getBody())

    for _ in range(flight["steps"]):
        group.empty()
        space.collide("", near)
        world.step(flight["dt_s"])
    return [*list(body.getPosition())[:2], *list(body.getLinearVel())[:2]]


def rapier3d(way: str, flight: Flight) -> End:
    """Rapier: boxes or capsules."""
    import rapier3d

    world = rapier3d.PhysicsWorld(gravity=(0.0, 0.0, 0.0))
    world.integration_parameters.dt = flight["dt_s"]
    for (ax, ay), (bx, by) in pairwise(flight["points_m"]):
        half, thick = math.hypot(bx - ax, by - ay) / 2, flight["half_width_m"]
        turned = math.atan2(by - ay, bx - ax)
        fixed = rapier3d.RigidBody.fixed().translation(((ax + bx) / 2, (ay + by) / 2, 0.0)).rotation((0.0, 0.0, turned))
        piece = rapier3d.Collider.cuboid(half, thick, 1.0)
        if way == "capsules":
            piece = rapier3d.Collider.capsule_x(half, thick)
        world.add_collider(piece.friction(0.0).restitution(1.0), world.add_body(fixed))
    disc = rapier3d.RigidBody.dynamic().translation((*flight["position_m"], 0.0)).linvel((*flight["velocity_m_s"], 0.0))
    disc = disc.can_sleep(False).enabled_rotations((False, False, False)).enabled_translations((True, True, False))
    handle = world.add_body(disc)
    world.add_collider(rapier3d.Collider.ball(flight["radius_m"]).friction(0.0).restitution(1.0).mass(MASS_KG), handle)
    for _ in range(flight["steps"]):
        world.step()
    body = world.rigid_bodies[handle]
    return [*map(float, body.translation.to_tuple()[:2]), *map(float, body.linvel.to_tuple()[:2])]


def newton(way: str, flight: Flight) -> End:
    """Newton: boxes or capsules, with the XPBD solver; the engine may search for contacts ahead."""
    import newton
    import numpy as np
    import warp

    builder = newton.ModelBuilder(gravity=(0.0, 0.0, 0.0))
    material = builder.ShapeConfig(density=0.0, restitution=1.0, mu=0.0)
    for (ax, ay), (bx, by) in pairwise(flight["points_m"]):
        half, thick = math.hypot(bx - ax, by - ay) / 2, flight["half_width_m"]
        turned = warp.quat_from_axis_angle(warp.vec3(0, 0, 1), math.atan2(by - ay, bx - ax))
        if way == "capsules":  # The capsule must be along x, but its default axis is z.
            turned *= warp.quat_from_axis_angle(warp.vec3(0, 1, 0), math.pi / 2)
        at = warp.transform(((ax + bx) / 2, (ay + by) / 2, 0.0), turned)
        if way == "capsules":
            builder.add_shape_capsule(-1, xform=at, radius=thick, half_height=half, cfg=material)
        else:
            builder.add_shape_box(-1, xform=at, hx=half, hy=thick, hz=1.0, cfg=material)
    radius = flight["radius_m"]
    inertia = np.eye(3) * (0.4 * MASS_KG * radius**2)
    at = warp.transform((*flight["position_m"], 0.0), warp.quat_identity())
    body = builder.add_body(xform=at, mass=MASS_KG, inertia=inertia, lock_inertia=True)
    builder.body_qd[body] = warp.spatial_vector(*flight["velocity_m_s"], 0.0, 0.0, 0.0, 0.0)
    builder.add_shape_sphere(body, radius=radius, cfg=material)
    model = builder.finalize(device="cpu")
    ahead = {"speculative_contact_gap_max": 1.0} if "ahead" in way else {}
    pipeline = newton.CollisionPipeline(model, **ahead)
    contacts, solver = pipeline.contacts(), newton.solvers.SolverXPBD(model, enable_restitution=True)
    state, after = model.state(), model.state()
    for _ in range(flight["steps"]):
        state.clear_forces()
        pipeline.collide(state, contacts, dt=flight["dt_s"])
        solver.step(state, after, None, contacts, flight["dt_s"])
        state, after = after, state
    return [*map(float, state.body_q.numpy()[0, :2]), *map(float, state.body_qd.numpy()[0, :2])]


ENGINES: dict[str, Callable[[str, Flight], End]] = {
    "Box2D": box2d,
    "dartpy": dart,
    "drake": drake,
    "mujoco": mujoco,
    "newton": newton,
    "panda3d": ode,
    "pybullet": pybullet,
    "pymunk": pymunk,
    "rapier3d": rapier3d,
}

if __name__ == "__main__":
    name, built = sys.argv[1:]
    json.dump([ENGINES[name](built, flight) for flight in json.load(sys.stdin)], sys.stdout)
