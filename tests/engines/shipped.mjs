// What an engine from npm ships, read from it, and two discs that meet in it with nothing else changed than Carom says.
// stdin: {"engine", "dt", "steps", "scenes": [[{x, y, v, r, m}]]}; stdout: {"values", "ends": [[[x, y, vx, vy]]]}.
// Run in the folder of the packages, where node finds them: `--input-type=module -e`.
import { readFileSync } from "node:fs";

const { engine, dt, steps, scenes } = JSON.parse(readFileSync(0, "utf8"));
const pick = (from, names) => Object.fromEntries(names.map((name) => [name, from[name]]));
const repeat = (step) => {
  for (let k = 0; k < steps; k++) step();
};

async function planck() {
  const { Circle, Settings, Vec2, World } = await import("planck");
  const world = new World();
  const body = world.createBody({ type: "dynamic" });
  const fixture = body.createFixture({ shape: new Circle(1), density: 1 });
  const values = {
    ...pick(Settings, ["linearSlop", "polygonRadius", "velocityThreshold", "maxTranslation", "maxRotation"]),
    velocityIterations: world.m_velocityIterations,
    positionIterations: world.m_positionIterations,
    allowSleep: world.getAllowSleeping(),
    warmStarting: world.getWarmStarting(),
    continuousPhysics: world.getContinuousPhysics(),
    bullet: body.isBullet(),
    chain: false, // a word of the adapter's own: edges, of which none knows the next
    fixedRotation: body.isFixedRotation(),
    restitution: fixture.getRestitution(),
    friction: fixture.getFriction(),
  };
  const run = (discs) => {
    const own = new World({ allowSleep: false });
    const bodies = discs.map(({ x, y, v, r, m }) => {
      const one = own.createBody({ type: "dynamic", position: new Vec2(x, y), linearVelocity: new Vec2(v, 0) });
      one.createFixture({ shape: new Circle(r), density: 1, friction: 0, restitution: 1 });
      one.setMassData({ mass: m, center: Vec2.zero(), I: 0.5 * m * r * r });
      return one;
    });
    repeat(() => own.step(dt));
    return bodies.map((one) => [one.getPosition(), one.getLinearVelocity()].flatMap(({ x, y }) => [x, y]));
  };
  return { values, run };
}

async function matter() {
  const { Bodies, Body, Composite, Engine, Resolver } = (await import("matter-js")).default;
  const [world, disc, large] = [Engine.create(), Bodies.circle(0, 0, 1), Bodies.circle(0, 0, 1e6)];
  const values = {
    ...pick(world, ["positionIterations", "velocityIterations"]),
    ...pick(disc, ["slop", "restitution", "friction", "frictionAir"]),
    restingThresh: Resolver._restingThresh,
    sides: large.vertices.length - 1, // of an odd number it makes the next one
    locked: disc.inertia === Infinity,
    pixels_per_m: null,
  };
  const scale = 128;
  const run = (discs) => {
    const own = Engine.create({ gravity: { x: 0, y: 0 } });
    const bodies = discs.map(({ x, y, v, r, m }) => {
      const one = Bodies.circle(x * scale, y * scale, r * scale, { restitution: 1, friction: 0, frictionAir: 0 });
      Body.setMass(one, m);
      Body.setVelocity(one, { x: (v * scale) / 60, y: 0 }); // pixels in 1/60 s, whatever the step
      return one;
    });
    Composite.add(own.world, bodies);
    repeat(() => Engine.update(own, dt * 1000));
    return bodies.map((one) => {
      const { x, y } = Body.getVelocity(one);
      return [one.position.x, one.position.y, x * 60, y * 60].map((value) => value / scale);
    });
  };
  return { values, run };
}

async function box2d3() {
  const b2 = await (await import("box2d3-wasm")).default({ pthreadCount: 0 });
  const [world, body, shape] = [b2.b2DefaultWorldDef(), b2.b2DefaultBodyDef(), b2.b2DefaultShapeDef()];
  const worlds = ["restitutionThreshold", "contactHertz", "contactDampingRatio", "maximumLinearSpeed", "enableSleep"];
  const values = {
    ...pick(world, [...worlds, "enableContinuous"]),
    bullet: body.isBullet ? "all" : "none",
    motionLocks: body.motionLocks.angularZ,
    restitution: shape.material.restitution,
    friction: shape.material.friction,
    subStepCount: null,
    contactSpeed: "not told",
    length_scale: 1,
  };
  const run = (discs) => {
    const def = b2.b2DefaultWorldDef();
    def.gravity.Set(0, 0);
    def.enableSleep = false;
    const own = b2.b2CreateWorld(def);
    const bodies = discs.map(({ x, y, v, r, m }) => {
      const one = b2.b2DefaultBodyDef();
      one.type = b2.b2BodyType.b2_dynamicBody;
      one.position.Set(x, y);
      one.linearVelocity.Set(v, 0);
      const id = b2.b2CreateBody(own, one);
      const ball = b2.b2DefaultShapeDef();
      [ball.material.friction, ball.material.restitution] = [0, 1];
      const circle = new b2.b2Circle();
      circle.radius = r;
      b2.b2CreateCircleShape(id, ball, circle);
      const data = b2.b2Body_GetMassData(id);
      data.rotationalInertia *= m / data.mass;
      data.mass = m;
      b2.b2Body_SetMassData(id, data);
      return id;
    });
    repeat(() => b2.b2World_Step(own, dt, 4));
    const ends = bodies.map((id) => [b2.b2Body_GetPosition(id), b2.b2Body_GetLinearVelocity(id)].flatMap(({ x, y }) => [x, y]));
    b2.b2DestroyWorld(own);
    return ends;
  };
  return { values, run };
}

async function jolt() {
  const Jolt = await (await import("jolt-physics")).default();
  const [FIXED, MOVING] = [0, 1];
  const made = () => {
    const settings = new Jolt.JoltSettings();
    const pairs = new Jolt.ObjectLayerPairFilterTable(2);
    pairs.EnableCollision(MOVING, MOVING);
    const layers = new Jolt.BroadPhaseLayerInterfaceTable(2, 2);
    for (const layer of [FIXED, MOVING]) layers.MapObjectToBroadPhaseLayer(layer, new Jolt.BroadPhaseLayer(layer));
    settings.mObjectLayerPairFilter = pairs;
    settings.mBroadPhaseLayerInterface = layers;
    settings.mObjectVsBroadPhaseLayerFilter = new Jolt.ObjectVsBroadPhaseLayerFilterTable(layers, 2, pairs, 2);
    return new Jolt.JoltInterface(settings);
  };
  const stepping = ["mSpeculativeContactDistance", "mPenetrationSlop", "mMinVelocityForRestitution"];
  const more = ["mNumVelocitySteps", "mNumPositionSteps", "mLinearCastThreshold", "mLinearCastMaxPenetration"];
  const first = made();
  const creation = new Jolt.BodyCreationSettings();
  const bodies = ["mLinearDamping", "mMaxLinearVelocity", "mAllowSleeping", "mRestitution", "mFriction", "mAllowedDOFs"];
  const values = {
    ...pick(first.GetPhysicsSystem().GetPhysicsSettings(), [...stepping, ...more]),
    ...pick(creation, bodies),
    linearCast: creation.mMotionQuality === Jolt.EMotionQuality_LinearCast,
    mEnhancedInternalEdgeRemoval: Boolean(creation.mEnhancedInternalEdgeRemoval),
    collisionSteps: null,
  };
  const run = (discs) => {
    const own = made();
    const system = own.GetPhysicsSystem();
    system.SetGravity(new Jolt.Vec3(0, 0, 0));
    const all = system.GetBodyInterface();
    const ones = discs.map(({ x, y, v, r, m }) => {
      const [place, turn] = [new Jolt.RVec3(x, y, 0), new Jolt.Quat(0, 0, 0, 1)];
      const one = new Jolt.BodyCreationSettings(new Jolt.SphereShape(r), place, turn, Jolt.EMotionType_Dynamic, MOVING);
      [one.mRestitution, one.mFriction, one.mLinearDamping, one.mAllowSleeping] = [1, 0, 0, false];
      one.mLinearVelocity = new Jolt.Vec3(v, 0, 0);
      one.mOverrideMassProperties = Jolt.EOverrideMassProperties_CalculateInertia;
      one.mMassPropertiesOverride.mMass = m;
      const body = all.CreateBody(one);
      all.AddBody(body.GetID(), Jolt.EActivation_Activate);
      return body;
    });
    repeat(() => own.Step(dt, 1));
    const ends = ones.map((body) => [body.GetPosition(), body.GetLinearVelocity()].flatMap((one) => [one.GetX(), one.GetY()]));
    Jolt.destroy(own);
    return ends;
  };
  return { values, run };
}

async function rapier2d() {
  const RAPIER = (await import("@dimforge/rapier2d-compat")).default;
  await RAPIER.init();
  const world = new RAPIER.World({ x: 0, y: 0 });
  const desc = RAPIER.RigidBodyDesc.dynamic();
  const body = world.createRigidBody(desc);
  const ball = world.createCollider(RAPIER.ColliderDesc.ball(1), body);
  const parameters = ["lengthUnit", "normalizedPredictionDistance", "numSolverIterations", "maxCcdSubsteps"];
  const values = {
    ...pick(world.integrationParameters, parameters),
    ccdEnabled: body.isCcdEnabled(),
    softCcdPrediction: body.softCcdPrediction(),
    canSleep: desc.canSleep,
    lockRotations: !desc.rotationsEnabled && desc.rotationsEnabled !== undefined,
    restitution: ball.restitution(),
    friction: ball.friction(),
  };
  const run = (discs) => {
    const own = new RAPIER.World({ x: 0, y: 0 });
    own.timestep = dt;
    const bodies = discs.map(({ x, y, v, r, m }) => {
      const one = own.createRigidBody(RAPIER.RigidBodyDesc.dynamic().setTranslation(x, y).setLinvel(v, 0).setCanSleep(false));
      own.createCollider(RAPIER.ColliderDesc.ball(r).setMass(m).setFriction(0).setRestitution(1), one);
      return one;
    });
    repeat(() => own.step());
    const ends = bodies.map((one) => [one.translation(), one.linvel()].flatMap(({ x, y }) => [x, y]));
    own.free();
    return ends;
  };
  return { values, run };
}

async function cannon() {
  const { Body, ContactMaterial, Material, Sphere, Vec3, World } = await import("cannon-es");
  const [world, material] = [new World(), new Material()];
  const [contact, body] = [new ContactMaterial(material, material), new Body({ mass: 1, shape: new Sphere(1) })];
  const values = {
    ...pick(world.solver, ["iterations", "tolerance"]),
    ...pick(contact, ["contactEquationStiffness", "contactEquationRelaxation", "restitution", "friction"]),
    allowSleep: world.allowSleep,
    linearDamping: body.linearDamping,
    linearFactor: body.linearFactor.toArray(),
  };
  const run = (discs) => {
    const own = new World();
    own.defaultContactMaterial.restitution = 1;
    own.defaultContactMaterial.friction = 0;
    const bodies = discs.map(({ x, y, v, r, m }) => {
      const options = { position: new Vec3(x, y, 0), velocity: new Vec3(v, 0, 0), linearDamping: 0 };
      const one = new Body({ mass: m, shape: new Sphere(r), ...options });
      own.addBody(one);
      return one;
    });
    repeat(() => own.step(dt));
    return bodies.map(({ position, velocity }) => [position.x, position.y, velocity.x, velocity.y]);
  };
  return { values, run };
}

async function p2() {
  const { Body, Circle, ContactMaterial, Material, World } = await import("p2-es");
  const [world, body] = [new World(), new Body({ mass: 1 })];
  const contact = new ContactMaterial(new Material(), new Material());
  const values = {
    ...pick(world.solver, ["iterations", "tolerance"]),
    ...pick(contact, ["stiffness", "relaxation", "contactSkinSize", "restitution", "friction"]),
    ...pick(body, ["ccdSpeedThreshold", "ccdIterations", "damping"]),
    islandSplit: world.islandSplit,
  };
  const run = (discs) => {
    const own = new World({ gravity: [0, 0] });
    [own.defaultContactMaterial.restitution, own.defaultContactMaterial.friction] = [1, 0];
    const bodies = discs.map(({ x, y, v, r, m }) => {
      const one = new Body({ mass: m, position: [x, y], velocity: [v, 0], damping: 0 });
      one.addShape(new Circle({ radius: r }));
      own.addBody(one);
      return one;
    });
    repeat(() => own.step(dt));
    return bodies.map(({ position, velocity }) => [...position, ...velocity]);
  };
  return { values, run };
}

async function havok() {
  const { createRequire } = await import("node:module");
  const wasm = createRequire(`${process.cwd()}/`).resolve("@babylonjs/havok/lib/esm/HavokPhysics.wasm");
  const HK = await (await import("@babylonjs/havok")).default({ wasmBinary: readFileSync(wasm) });
  const [[, world], [, body], [, ball]] = [HK.HP_World_Create(), HK.HP_Body_Create(), HK.HP_Shape_CreateSphere([0, 0, 0], 1)];
  const [, [, friction, restitution]] = HK.HP_Shape_GetMaterial(ball);
  const values = {
    units_per_m: 1,
    idealStepTime: "not told",
    maxLinearVelocity: HK.HP_World_GetSpeedLimit(world)[1],
    linearDamping: HK.HP_Body_GetLinearDamping(body)[1],
    canSleep: true,
    restitution,
    friction,
  };
  const run = (discs) => {
    const [, own] = HK.HP_World_Create();
    HK.HP_World_SetGravity(own, [0, 0, 0]);
    const bodies = discs.map(({ x, y, v, r, m }) => {
      const [[, one], [, shape]] = [HK.HP_Body_Create(), HK.HP_Shape_CreateSphere([0, 0, 0], r)];
      HK.HP_Shape_SetMaterial(shape, [0, 0, 1, HK.MaterialCombine.MINIMUM, HK.MaterialCombine.MINIMUM]);
      HK.HP_Body_SetShape(one, shape);
      HK.HP_Body_SetMotionType(one, HK.MotionType.DYNAMIC);
      const [, [centre, , inertia, axes]] = HK.HP_Shape_BuildMassProperties(shape);
      HK.HP_Body_SetMassProperties(one, [centre, m, inertia, axes]);
      HK.HP_Body_SetActivationControl(one, HK.ActivationControl.ALWAYS_ACTIVE);
      HK.HP_Body_SetQTransform(one, [[x, y, 0], [0, 0, 0, 1]]);
      HK.HP_World_AddBody(own, one, false);
      HK.HP_Body_SetLinearVelocity(one, [v, 0, 0]);
      return one;
    });
    repeat(() => HK.HP_World_Step(own, dt));
    return bodies.map((one) => {
      const [[, [[x, y]]], [, [vx, vy]]] = [HK.HP_Body_GetQTransform(one), HK.HP_Body_GetLinearVelocity(one)];
      return [x, y, vx, vy];
    });
  };
  return { values, run };
}

async function physx() {
  const { createRequire } = await import("node:module");
  const library = createRequire(`${process.cwd()}/`).resolve("physx-js-webidl");
  Object.defineProperty(process, "versions", { value: { ...process.versions, node: undefined } });
  [globalThis.window, globalThis.document] = [globalThis, { currentScript: null }];
  const wasmBinary = readFileSync(library.replace(/\.mjs$/, ".wasm"));
  const Px = await (await import(library)).default({ wasmBinary, print: console.error });
  const top = Px.PxTopLevelFunctions.prototype;
  const [allocator, callback, scale] = [new Px.PxDefaultAllocator(), new Px.PxDefaultErrorCallback(), new Px.PxTolerancesScale()];
  const physics = top.CreatePhysics(Px.PHYSICS_VERSION, top.CreateFoundation(Px.PHYSICS_VERSION, allocator, callback), scale);
  const dispatcher = top.DefaultCpuDispatcherCreate(0);
  const describe = () => {
    const described = new Px.PxSceneDesc(scale);
    described.cpuDispatcher = dispatcher;
    described.filterShader = top.DefaultFilterShader();
    return described;
  };
  const body = (x, y, r, m, e) => {
    const pose = new Px.PxTransform(new Px.PxVec3(x, y, 0), new Px.PxQuat(0, 0, 0, 1));
    const made = physics.createRigidDynamic(pose);
    const flags = new Px.PxShapeFlags(Px.PxShapeFlagEnum.eSIMULATION_SHAPE);
    const shape = physics.createShape(new Px.PxSphereGeometry(r), physics.createMaterial(0, 0, e), true, flags);
    shape.setSimulationFilterData(new Px.PxFilterData(1, 1, 0, 0));
    made.attachShape(shape);
    Px.PxRigidBodyExt.prototype.setMassAndUpdateInertia(made, m);
    return [made, shape];
  };
  const [[one, shape], first] = [body(0, 0, 1, 1, 0), describe()];
  const values = {
    bounceThresholdVelocity: first.bounceThresholdVelocity,
    solver: first.solverType === Px.PxSolverTypeEnum.ePGS ? "ePGS" : "eTGS",
    ccd: Boolean(first.flags.isSet(Px.PxSceneFlagEnum.eENABLE_CCD)),
    contactOffset: shape.getContactOffset(),
    maxDepenetrationVelocity: one.getMaxDepenetrationVelocity(),
    linearDamping: one.getLinearDamping(),
    positionIterations: "not told",
    velocityIterations: "not told",
    canSleep: one.getSleepThreshold() > 0,
    restitution: null,
    friction: null,
    lockFlags: null,
  };
  const run = (discs) => {
    const own = physics.createScene(describe());
    const bodies = discs.map(({ x, y, v, r, m }) => {
      const [made] = body(x, y, r, m, 1);
      made.setSleepThreshold(0);
      made.setLinearVelocity(new Px.PxVec3(v, 0, 0));
      own.addActor(made);
      return made;
    });
    repeat(() => {
      own.simulate(dt);
      own.fetchResults(true);
    });
    return bodies.map((made) => {
      const [{ p }, v] = [made.getGlobalPose(), made.getLinearVelocity()];
      return [p.x, p.y, v.x, v.y];
    });
  };
  return { values, run };
}

const { values, run } = await { planck, matter, box2d3, jolt, rapier2d, cannon, p2, havok, physx }[engine]();
process.stdout.write(JSON.stringify({ values, ends: scenes.map(run) }));
