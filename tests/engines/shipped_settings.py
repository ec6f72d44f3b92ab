"""What the engines that `make engines` installs ship, read from themselves: see `tests.adapters.shipped_settings`."""

import json
import logging
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from tests.adapters.shipped_settings import DT_S, NOT_TOLD, PHASES, SPEEDS, STEPS, End, Shipped, build_meeting_scene
from tests.processes import run_command

from carom import Disc
from carom_adapters import npm


def read_rapier_defaults() -> Shipped:
    """Rapier's own: the parameters of a world, and what a body and its collider are given."""
    import rapier3d

    engine: Any = rapier3d
    world = engine.PhysicsWorld()
    parameters = world.integration_parameters
    body = world.rigid_bodies[world.add_body(engine.RigidBody.dynamic())]
    ball = world.colliders[world.add_collider(engine.Collider.ball(1.0), world.add_body(engine.RigidBody.dynamic()))]
    names = ("length_unit", "num_solver_iterations", "normalized_prediction_distance", "contact_recycling")
    values: dict[str, object] = {
        name: getattr(parameters, name) for name in (*names, "normalized_max_linear_velocity", "warmstart_coefficient")
    }
    values |= {
        "contact_natural_frequency": parameters.contact_softness.natural_frequency,
        "static_contact_natural_frequency": parameters.static_contact_softness.natural_frequency,
        # A body that can't sleep has a negative threshold of sleep.
        "can_sleep": body.activation.linear_threshold >= 0,
        "soft_ccd_prediction": body.soft_ccd_prediction,
        "restitution": ball.restitution,
        "friction": ball.friction,
        "enabled_rotations": None,
        "enabled_translations": None,
    }

    def run(discs: Sequence[Disc]) -> End:
        world, handles = engine.PhysicsWorld(gravity=(0.0, 0.0, 0.0)), []
        world.integration_parameters.dt = DT_S
        for disc in discs:
            body = engine.RigidBody.dynamic().translation((*disc.position_m, 0.0)).linvel((*disc.velocity_m_s, 0.0))
            handles.append(world.add_body(body.can_sleep(False)))
            ball = engine.Collider.ball(disc.radius_m).restitution(1.0).friction(0.0).mass(disc.mass_kg)
            world.add_collider(ball, handles[-1])
        for _ in range(STEPS):
            world.step()
        bodies = [world.rigid_bodies[handle] for handle in handles]
        return np.array([[*body.translation.to_tuple()[:2], *body.linvel.to_tuple()[:2]] for body in bodies])

    return Shipped(values, run)


def read_dart_defaults() -> Shipped:
    """DART's own: a world's solver and detector, and what a shape is given."""
    import dartpy

    engine: Any = dartpy

    def shaped(body: Any, radius_m: float) -> Any:
        node = body.createShapeNode(engine.dynamics.SphereShape(radius_m))
        node.createCollisionAspect()
        node.createDynamicsAspect()
        return node.getDynamicsAspect()

    world = engine.simulation.World()
    solver = world.getConstraintSolver()
    aspect = shaped(engine.dynamics.Skeleton("one").createFreeJointAndBodyNodePair()[1], 1.0)
    values = {
        "collision_detector": solver.getCollisionDetector().getType().upper(),
        "split_impulse": solver.isSplitImpulseEnabled(),
        "restitution": aspect.getRestitutionCoeff(),
        "friction": aspect.getFrictionCoeff(),
        "joint": None,
    }

    def run(discs: Sequence[Disc]) -> End:
        world, skeletons = engine.simulation.World(), []
        world.setGravity([0, 0, 0])
        world.setTimeStep(DT_S)
        for k, disc in enumerate(discs):
            skeleton = engine.dynamics.Skeleton(f"disc {k}")
            _, body = skeleton.createTranslationalJoint2DAndBodyNodePair()
            aspect = shaped(body, disc.radius_m)
            aspect.setRestitutionCoeff(1.0)
            aspect.setFrictionCoeff(0.0)
            body.setMass(disc.mass_kg)
            world.addSkeleton(skeleton)
            skeleton.setPositions(disc.position_m)
            skeleton.setVelocities(disc.velocity_m_s)
            skeletons.append(skeleton)
        for _ in range(STEPS):
            world.step()
        return np.array([[*skeleton.getPositions(), *skeleton.getVelocities()] for skeleton in skeletons])

    return Shipped(values, run)


def read_ode_defaults() -> Shipped:
    """ODE's own: a world, and the surface of a contact; which of its steppers is called is the caller's choice."""
    from panda3d import ode

    engine: Any = ode
    world, surface = engine.OdeWorld(), engine.OdeSurfaceParameters()
    values = {
        "cfm": world.getCfm(),
        "erp": world.getErp(),
        "quick_step_iterations": world.getQuickStepNumIterations(),
        "stepper": NOT_TOLD,
        "bounce": surface.getBounce(),
        "mu": surface.getMu(),
        "mode": surface.getMode(),
    }

    def run(discs: Sequence[Disc]) -> End:
        world, group, bodies, geoms = engine.OdeWorld(), engine.OdeJointGroup(), [], []
        for disc in discs:
            body, mass = engine.OdeBody(world), engine.OdeMass()
            mass.setSphereTotal(disc.mass_kg, disc.radius_m)
            body.setMass(mass)
            body.setPosition(*disc.position_m, 0.0)
            body.setLinearVel(*disc.velocity_m_s, 0.0)
            geoms.append(engine.OdeSphereGeom(disc.radius_m))
            geoms[-1].setBody(body)
            bodies.append(body)
        surface = engine.OdeSurfaceParameters(engine.OdeSurfaceParameters.MFContactBounce)
        surface.setBounce(1.0)
        for _ in range(STEPS):
            met = engine.OdeUtil.collide(*geoms, 1)
            for k in range(met.getNumContacts()):
                contact = engine.OdeContact()
                contact.setGeom(met.getContactGeom(k))
                contact.setSurface(surface)
                engine.OdeContactJoint(world, group, contact).attach(*bodies)
            world.step(DT_S)
            group.empty()
        return np.array([[*list(body.getPosition())[:2], *list(body.getLinearVel())[:2]] for body in bodies])

    return Shipped(values, run)


def read_newton_defaults() -> Shipped:
    """Newton's own: a model's shapes, and its XPBD solver."""
    import newton
    import warp

    warp.config.log_level = warp.LOG_ERROR

    def made(discs: Sequence[Disc]) -> Any:
        builder = newton.ModelBuilder(gravity=(0.0, 0.0, 0.0))
        for disc in discs:
            (x, y), (vx, vy) = disc.position_m, disc.velocity_m_s
            inertia = np.eye(3) * (0.4 * disc.mass_kg * disc.radius_m**2)
            at = warp.transform((x, 0.0, y), warp.quat_identity())
            body = builder.add_body(xform=at, mass=disc.mass_kg, inertia=inertia, lock_inertia=True)
            builder.body_qd[body] = warp.spatial_vector(vx, 0.0, vy, 0.0, 0.0, 0.0)
            shape = newton.ModelBuilder.ShapeConfig(density=0.0, restitution=1.0, mu=0.0)
            builder.add_shape_sphere(body, radius=disc.radius_m, cfg=shape)
        return builder.finalize(device="cpu")

    model, shape = made([Disc(position_m=(0, 0), radius_m=1)]), newton.ModelBuilder.ShapeConfig()
    solver = newton.solvers.SolverXPBD(model)
    names = ("iterations", "rigid_contact_relaxation", "rigid_contact_restitution_iterations")
    values = {name: getattr(solver, name) for name in (*names, "rigid_contact_con_weighting", "enable_restitution")}
    values |= {"gap": float(model.shape_gap.numpy()[0]), "restitution": shape.restitution, "mu": shape.mu}

    def run(discs: Sequence[Disc]) -> End:
        model = made(discs)
        pipeline, solver = newton.CollisionPipeline(model), newton.solvers.SolverXPBD(model, enable_restitution=True)
        contacts, state, after = pipeline.contacts(), model.state(), model.state()
        for _ in range(STEPS):
            state.clear_forces()
            pipeline.collide(state, contacts)
            solver.step(state, after, None, contacts, DT_S)
            state, after = after, state
        return np.hstack([state.body_q.numpy()[:, (0, 2)], state.body_qd.numpy()[:, (0, 2)]])

    return Shipped(values, run)


def read_drake_defaults() -> Shipped:
    """Drake's own: a plant's, a scene graph's and a simulator's configurations."""
    from pydrake import geometry
    from pydrake.math import RigidTransform
    from pydrake.multibody import plant, tree
    from pydrake.systems import analysis, framework

    logging.getLogger("drake").setLevel(logging.ERROR)
    simulated, proximity = analysis.SimulatorConfig(), geometry.SceneGraphConfig().default_proximity_properties
    values = {
        "point_stiffness": proximity.point_stiffness,
        "target_accuracy": simulated.accuracy,
        "integration_scheme": simulated.integration_scheme,
        "time_step": plant.MultibodyPlantConfig().time_step,
        "hunt_crossley_dissipation": proximity.hunt_crossley_dissipation,
        "dynamic_friction": proximity.dynamic_friction,
        "static_friction": proximity.static_friction,
        "joint": None,
    }

    def run(discs: Sequence[Disc]) -> End:
        builder = framework.DiagramBuilder()
        own, _ = plant.AddMultibodyPlantSceneGraph(builder, time_step=0.0)
        own.mutable_gravity_field().set_gravity_vector([0, 0, 0])
        joints = []
        for k, disc in enumerate(discs):
            inertia = tree.SpatialInertia.SolidSphereWithMass(disc.mass_kg, disc.radius_m)
            body = own.AddRigidBody(f"disc {k}", inertia)
            properties = geometry.ProximityProperties()
            frictionless = plant.CoulombFriction(0.0, 0.0)
            geometry.AddContactMaterial(dissipation=0.0, friction=frictionless, properties=properties)
            ball = geometry.Sphere(disc.radius_m)
            own.RegisterCollisionGeometry(body, RigidTransform(), ball, f"ball {k}", properties)
            world = own.world_body().body_frame()
            joints.append(own.AddJoint(tree.PlanarJoint(f"plane {k}", world, body.body_frame(), damping=[0, 0, 0])))
        own.Finalize()
        simulator = analysis.Simulator(builder.Build())
        context = own.GetMyMutableContextFromRoot(simulator.get_mutable_context())
        for joint, disc in zip(joints, discs, strict=True):
            joint.set_translation(context, disc.position_m)
            joint.set_translational_velocity(context, disc.velocity_m_s)
        for step in range(1, STEPS + 1):
            simulator.AdvanceTo(step * DT_S)
        places, speeds = own.GetPositions(context), own.GetVelocities(context)
        return np.hstack([places.reshape(-1, 3)[:, :2], speeds.reshape(-1, 3)[:, :2]])

    return Shipped(values, run)


def _read_npm_defaults(engine: str, roundings: int) -> Shipped:
    """Ask node once, for what is shipped and for all that `measure_largest_difference` will ask for."""
    scenes = [build_meeting_scene(speed, phase).discs for speed in SPEEDS for phase in PHASES]
    asked = {
        "engine": engine,
        "dt": DT_S,
        "steps": STEPS,
        "scenes": [list(map(_describe_disc, discs)) for discs in scenes],
    }
    program = Path(__file__).with_name("shipped.mjs").read_text(encoding="utf-8")
    done = run_command(
        ["node", "--input-type=module", "-e", program], input=json.dumps(asked), cwd=Path(npm.__file__).parent
    )
    told = json.loads(done.stdout)
    ends = {discs: np.array(end) for discs, end in zip(scenes, told["ends"], strict=True)}
    return Shipped(told["values"], lambda discs: ends[tuple(discs)], roundings)


def _describe_disc(disc: Disc) -> dict[str, float]:
    (x, y), (v, _) = disc.position_m, disc.velocity_m_s
    return {"x": x, "y": y, "v": v, "r": disc.radius_m, "m": disc.mass_kg}


OF_ENGINES: dict[str, Callable[[], Shipped]] = {
    "rapier": read_rapier_defaults,
    "dart": read_dart_defaults,
    "drake": read_drake_defaults,
    "ode": read_ode_defaults,
    "newton": read_newton_defaults,
    "planck": lambda: _read_npm_defaults("planck", 0),
    "matter": lambda: _read_npm_defaults("matter", 0),
    "box2d3": lambda: _read_npm_defaults("box2d3", 3),
    "jolt": lambda: _read_npm_defaults("jolt", 3),
    "rapier2d": lambda: _read_npm_defaults("rapier2d", 0),
    "cannon": lambda: _read_npm_defaults("cannon", 0),
    "p2": lambda: _read_npm_defaults("p2", 0),
    "havok": lambda: _read_npm_defaults("havok", 0),
    "physx": lambda: _read_npm_defaults("physx", 3),
}
