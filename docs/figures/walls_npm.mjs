// Flights of one disc at walls in the engines from npm, for walls.py, which runs this in the folder that has them: each in
// the engine's own calls. Arguments: package and way; standard input: flights as JSON; standard output: where each ends.
// All is as shipped except restitution 1, no friction, no damping and no sleep.
import { readFileSync } from "node:fs";
import { createRequire } from "node:module";
import { pathToFileURL } from "node:url";

const [name, way] = process.argv.slice(-2);
const pairs = (points) => points.slice(1).map((b, k) => [points[k], b]);
// Of each edge: its middle, half its length, and its angle.
const boxes = (points) =>
  pairs(points).map(([[ax, ay], [bx, by]]) => ({
    x: (ax + bx) / 2, y: (ay + by) / 2, half: Math.hypot(bx - ax, by - ay) / 2, angle: Math.atan2(by - ay, bx - ax),
  }));
const MASS = 1; // kg: any will do at a wall
const DEPTH = 1; // m: half the depth of what is three-dimensional
const density = (radius) => MASS / (Math.PI * radius * radius);

const ENGINES = {
  async planck() {
    const { World, Vec2, Circle, Edge, Chain } = await import("planck");
    return ({ dt_s, steps, position_m, velocity_m_s, radius_m, points_m }) => {
      const world = new World({ gravity: new Vec2(0, 0) });
      const [points, material] = [points_m.map((point) => new Vec2(...point)), { restitution: 1, friction: 0 }];
      const wall = world.createBody();
      const shapes = way === "chain" ? [new Chain(points, false)] : pairs(points).map(([a, b]) => new Edge(a, b));
      for (const shape of shapes) wall.createFixture({ shape, ...material });
      const disc = world.createBody({
        type: "dynamic", position: new Vec2(...position_m), linearVelocity: new Vec2(...velocity_m_s), fixedRotation: true, allowSleep: false,
      });
      disc.createFixture({ shape: new Circle(radius_m), density: density(radius_m), ...material });
      for (let k = 0; k < steps; k++) world.step(dt_s);
      const [p, v] = [disc.getPosition(), disc.getLinearVelocity()];
      return [p.x, p.y, v.x, v.y];
    };
  },
  async "@dimforge/rapier2d-compat"() {
    const module = await import("@dimforge/rapier2d-compat");
    const R = module.default ?? module;
    await R.init();
    return ({ dt_s, steps, position_m, velocity_m_s, radius_m, points_m, half_width_m }) => {
      const world = new R.World({ x: 0, y: 0 });
      world.timestep = dt_s;
      const add = (shape, body) => world.createCollider(shape.setFriction(0).setRestitution(1), body);
      const [first, ...rest] = points_m.map(([x, y]) => ({ x, y }));
      if (way === "polyline") add(R.ColliderDesc.polyline(new Float32Array(points_m.flat())));
      else if (way === "segments") pairs([first, ...rest]).forEach(([a, b]) => add(R.ColliderDesc.segment(a, b)));
      else
        for (const { x, y, half, angle } of boxes(points_m))
          add(R.ColliderDesc.cuboid(half, half_width_m).setTranslation(x, y).setRotation(angle));
      const desc = R.RigidBodyDesc.dynamic().setTranslation(...position_m).setLinvel(...velocity_m_s).lockRotations();
      const disc = world.createRigidBody(desc.setCanSleep(false));
      add(R.ColliderDesc.ball(radius_m), disc);
      for (let k = 0; k < steps; k++) world.step();
      const [p, v] = [disc.translation(), disc.linvel()];
      const end = [p.x, p.y, v.x, v.y];
      world.free();
      return end;
    };
  },
  async "box2d3-wasm"() {
    const b2 = await (await import("box2d3-wasm")).default({ pthreadCount: 0 });
    return ({ dt_s, steps, position_m, velocity_m_s, radius_m, points_m }) => {
      const worldDef = b2.b2DefaultWorldDef();
      worldDef.gravity.Set(0, 0);
      const world = b2.b2CreateWorld(worldDef);
      const shapeDef = () => {
        const def = b2.b2DefaultShapeDef();
        [def.material.friction, def.material.restitution] = [0, 1];
        return def;
      };
      const ground = b2.b2CreateBody(world, b2.b2DefaultBodyDef());
      if (way === "chain") {
        // Its free side is on the right of its way, and its first and last points are ghosts: a metre beyond the wall's ends.
        const back = [...points_m].reverse();
        const beyond = ([ax, ay], [bx, by]) => {
          const length = Math.hypot(ax - bx, ay - by);
          return [ax + (ax - bx) / length, ay + (ay - by) / length];
        };
        const all = [beyond(back[0], back[1]), ...back, beyond(back.at(-1), back.at(-2))];
        const def = b2.b2DefaultChainDef();
        def.SetPoints(all.map((point) => new b2.b2Vec2(...point)));
        const material = b2.b2DefaultSurfaceMaterial();
        [material.friction, material.restitution] = [0, 1];
        def.SetMaterials([material]);
        b2.b2CreateChain(ground, def);
      } else
        for (const [a, b] of pairs(points_m)) {
          const segment = new b2.b2Segment();
          segment.point1.Set(...a);
          segment.point2.Set(...b);
          b2.b2CreateSegmentShape(ground, shapeDef(), segment);
        }
      const def = b2.b2DefaultBodyDef();
      def.type = b2.b2BodyType.b2_dynamicBody;
      def.position.Set(...position_m);
      def.linearVelocity.Set(...velocity_m_s);
      def.motionLocks.angularZ = true;
      def.enableSleep = false;
      const disc = b2.b2CreateBody(world, def);
      const circle = new b2.b2Circle();
      circle.radius = radius_m;
      const ofDisc = shapeDef();
      ofDisc.density = density(radius_m);
      b2.b2CreateCircleShape(disc, ofDisc, circle);
      for (let k = 0; k < steps; k++) b2.b2World_Step(world, dt_s, 4);
      const [p, v] = [b2.b2Body_GetPosition(disc), b2.b2Body_GetLinearVelocity(disc)];
      const end = [p.x, p.y, v.x, v.y];
      b2.b2DestroyWorld(world);
      return end;
    };
  },
  async "matter-js"() {
    const module = await import("matter-js");
    const { Bodies, Body, Composite, Engine } = module.default ?? module;
    const PX = 100; // a metre: its constants are made for pixels
    return ({ dt_s, steps, position_m, velocity_m_s, radius_m, points_m, half_width_m }) => {
      const engine = Engine.create({ gravity: { x: 0, y: 0 } });
      const material = { friction: 0, frictionStatic: 0, frictionAir: 0, restitution: 1 };
      for (const { x, y, half, angle } of boxes(points_m)) {
        const of = { isStatic: true, angle, ...material };
        const wall = Bodies.rectangle(x * PX, y * PX, 2 * half * PX, 2 * half_width_m * PX, of);
        wall.restitution = 1; // to be static sets it to 0
        Composite.add(engine.world, wall);
      }
      const [x, y] = position_m.map((one) => one * PX);
      const disc = Bodies.circle(x, y, radius_m * PX, material, 200); // corners at most, of the polygon that it is
      Body.setInertia(disc, Infinity);
      disc.deltaTime = dt_s * 1000;
      disc.positionPrev = { x: x - velocity_m_s[0] * dt_s * PX, y: y - velocity_m_s[1] * dt_s * PX };
      Composite.add(engine.world, disc);
      for (let k = 0; k < steps; k++) Engine.update(engine, dt_s * 1000);
      const [p, q] = [disc.position, disc.positionPrev];
      return [p.x / PX, p.y / PX, (p.x - q.x) / PX / dt_s, (p.y - q.y) / PX / dt_s];
    };
  },
  async "jolt-physics"() {
    const J = await (await import("jolt-physics")).default();
    return ({ dt_s, steps, position_m, velocity_m_s, radius_m, points_m, half_width_m }) => {
      const settings = new J.JoltSettings();
      settings.mMaxBodies = 64;
      const [filter, layers] = [new J.ObjectLayerPairFilterTable(2), new J.BroadPhaseLayerInterfaceTable(2, 2)];
      for (const layer of [0, 1]) {
        filter.EnableCollision(layer, 1);
        layers.MapObjectToBroadPhaseLayer(layer, new J.BroadPhaseLayer(layer));
      }
      settings.mObjectLayerPairFilter = filter;
      settings.mBroadPhaseLayerInterface = layers;
      settings.mObjectVsBroadPhaseLayerFilter = new J.ObjectVsBroadPhaseLayerFilterTable(layers, 2, filter, 2);
      const jolt = new J.JoltInterface(settings);
      jolt.GetPhysicsSystem().SetGravity(new J.Vec3(0, 0, 0));
      const bodies = jolt.GetPhysicsSystem().GetBodyInterface();
      const turned = (angle) => new J.Quat(0, 0, Math.sin(angle / 2), Math.cos(angle / 2));
      const add = (shape, x, y, angle, type, layer, more) => {
        const of = new J.BodyCreationSettings(shape, new J.RVec3(x, y, 0), turned(angle), type, layer);
        [of.mFriction, of.mRestitution] = [0, 1];
        more?.(of);
        const body = bodies.CreateBody(of);
        bodies.AddBody(body.GetID(), J.EActivation_Activate);
        return body;
      };
      // A box's corners are rounded by 5 cm as shipped, more than these have.
      const box = (half) => new J.BoxShape(new J.Vec3(half, half_width_m, DEPTH), 0);
      if (way.includes("compound")) {
        const compound = new J.StaticCompoundShapeSettings();
        for (const { x, y, half, angle } of boxes(points_m)) compound.AddShapeShape(new J.Vec3(x, y, 0), turned(angle), box(half), 0);
        add(compound.Create().Get(), 0, 0, 0, J.EMotionType_Static, 0);
      } else for (const { x, y, half, angle } of boxes(points_m)) add(box(half), x, y, angle, J.EMotionType_Static, 0);
      const disc = add(new J.SphereShape(radius_m), ...position_m, 0, J.EMotionType_Dynamic, 1, (of) => {
        [of.mLinearDamping, of.mAngularDamping, of.mAllowSleeping] = [0, 0, false];
        of.mLinearVelocity = new J.Vec3(...velocity_m_s, 0);
        of.mAllowedDOFs = J.EAllowedDOFs_TranslationX | J.EAllowedDOFs_TranslationY;
        of.mMotionQuality = way.includes("cast") ? J.EMotionQuality_LinearCast : J.EMotionQuality_Discrete;
        of.mEnhancedInternalEdgeRemoval = way.includes("removal");
      });
      for (let k = 0; k < steps; k++) jolt.Step(dt_s, 1);
      const [p, v] = [disc.GetPosition(), disc.GetLinearVelocity()];
      const end = [p.GetX(), p.GetY(), v.GetX(), v.GetY()];
      J.destroy(jolt);
      return end;
    };
  },
  async "p2-es"() {
    const { Body, Box, Capsule, Circle, Line, World } = await import("p2-es");
    return ({ dt_s, steps, position_m, velocity_m_s, radius_m, points_m, half_width_m }) => {
      const world = new World({ gravity: [0, 0] });
      [world.defaultContactMaterial.friction, world.defaultContactMaterial.restitution] = [0, 1];
      const shapeOf = {
        lines: (half) => new Line({ length: 2 * half }),
        capsules: (half) => new Capsule({ length: 2 * half, radius: half_width_m }),
      }[way] ?? ((half) => new Box({ width: 2 * half, height: 2 * half_width_m }));
      for (const { x, y, half, angle } of boxes(points_m)) {
        const wall = new Body({ position: [x, y], angle });
        wall.addShape(shapeOf(half));
        world.addBody(wall);
      }
      const swept = way.includes("swept") ? { ccdSpeedThreshold: 0 } : {}; // swept above this speed; as shipped never
      const disc = new Body({ mass: MASS, position: position_m, velocity: velocity_m_s, damping: 0, fixedRotation: true, ...swept });
      disc.addShape(new Circle({ radius: radius_m }));
      world.addBody(disc);
      for (let k = 0; k < steps; k++) world.step(dt_s);
      return [...disc.position, ...disc.velocity];
    };
  },
  async "@babylonjs/havok"() {
    const { default: createHavok } = await import("@babylonjs/havok");
    const library = pathToFileURL(createRequire(import.meta.url).resolve("@babylonjs/havok"));
    const HK = await createHavok({ wasmBinary: readFileSync(new URL("../esm/HavokPhysics.wasm", library)) });
    return ({ dt_s, steps, position_m, velocity_m_s, radius_m, points_m, half_width_m }) => {
      const [, world] = HK.HP_World_Create();
      HK.HP_World_SetGravity(world, [0, 0, 0]);
      const add = ([, shape], [x, y], angle, type) => {
        const [, body] = HK.HP_Body_Create();
        const { MAXIMUM, MINIMUM } = HK.MaterialCombine;
        HK.HP_Shape_SetMaterial(shape, [0, 0, 1, MINIMUM, MAXIMUM]);
        HK.HP_Body_SetShape(body, shape);
        HK.HP_Body_SetMotionType(body, type);
        HK.HP_Body_SetQTransform(body, [[x, y, 0], [0, 0, Math.sin(angle / 2), Math.cos(angle / 2)]]);
        return [body, shape];
      };
      for (const { x, y, half, angle } of boxes(points_m)) {
        const [facing, size] = [[0, 0, 0, 1], [2 * half, 2 * half_width_m, 2 * DEPTH]];
        const box = () => HK.HP_Shape_CreateBox([0, 0, 0], facing, size);
        const shape = way === "capsules" ? HK.HP_Shape_CreateCapsule([-half, 0, 0], [half, 0, 0], half_width_m) : box();
        HK.HP_World_AddBody(world, add(shape, [x, y], angle, HK.MotionType.STATIC)[0], false);
      }
      const [disc, ball] = add(HK.HP_Shape_CreateSphere([0, 0, 0], radius_m), position_m, 0, HK.MotionType.DYNAMIC);
      const [, [centre, , inertia, axes]] = HK.HP_Shape_BuildMassProperties(ball);
      HK.HP_Body_SetMassProperties(disc, [centre, MASS, inertia, axes]);
      HK.HP_Body_SetLinearDamping(disc, 0);
      HK.HP_Body_SetActivationControl(disc, HK.ActivationControl.ALWAYS_ACTIVE);
      HK.HP_World_AddBody(world, disc, false);
      HK.HP_Body_SetLinearVelocity(disc, [...velocity_m_s, 0]);
      for (let k = 0; k < steps; k++) HK.HP_World_Step(world, dt_s);
      const [[, [place]], [, velocity]] = [HK.HP_Body_GetQTransform(disc), HK.HP_Body_GetLinearVelocity(disc)];
      HK.HP_World_Release(world);
      return [place[0], place[1], velocity[0], velocity[1]];
    };
  },
  async "physx-js-webidl"() {
    // The build is for browsers, and refuses to start where it sees node.
    const library = createRequire(import.meta.url).resolve("physx-js-webidl");
    const { versions } = process;
    Object.defineProperty(process, "versions", { value: { ...versions, node: undefined } });
    [globalThis.window, globalThis.document] = [globalThis, { currentScript: null }];
    const { default: create } = await import(library);
    const Px = await create({ wasmBinary: readFileSync(library.replace(/\.mjs$/, ".wasm")), print: console.error, printErr: console.error });
    Object.defineProperty(process, "versions", { value: versions });
    const top = Px.PxTopLevelFunctions.prototype;
    const foundation = top.CreateFoundation(Px.PHYSICS_VERSION, new Px.PxDefaultAllocator(), new Px.PxDefaultErrorCallback());
    const scale = new Px.PxTolerancesScale();
    const physics = top.CreatePhysics(Px.PHYSICS_VERSION, foundation, scale);
    const dispatcher = top.DefaultCpuDispatcherCreate(0);
    const material = physics.createMaterial(0, 0, 1);
    const swept = way.includes("CCD");
    const { PxPairFlagEnum: Pair, PxRigidDynamicLockFlagEnum: Lock, PxRigidBodyFlagEnum: Flag } = Px;
    const filter = new Px.PassThroughFilterShaderImpl();
    filter.filterShader = () => {
      filter.outputPairFlags = Pair.eCONTACT_DEFAULT | (swept ? Pair.eDETECT_CCD_CONTACT : 0);
      return 0;
    };
    return ({ dt_s, steps, position_m, velocity_m_s, radius_m, points_m, half_width_m }) => {
      const described = new Px.PxSceneDesc(scale);
      described.gravity = new Px.PxVec3(0, 0, 0);
      described.cpuDispatcher = dispatcher;
      if (swept) described.flags.raise(Px.PxSceneFlagEnum.eENABLE_CCD);
      top.setupPassThroughFilterShader(described, filter);
      const scene = physics.createScene(described);
      const add = (kind, geometry, x, y, angle, set = () => {}) => {
        const turn = new Px.PxQuat(0, 0, Math.sin(angle / 2), Math.cos(angle / 2));
        const body = physics[kind](new Px.PxTransform(new Px.PxVec3(x, y, 0), turn));
        const shape = physics.createShape(geometry, material, true, new Px.PxShapeFlags(Px.PxShapeFlagEnum.eSIMULATION_SHAPE));
        shape.setSimulationFilterData(new Px.PxFilterData(1, 1, 0, 0));
        body.attachShape(shape);
        set(body);
        scene.addActor(body);
        return body;
      };
      const geometry = (half) =>
        way.startsWith("capsules") ? new Px.PxCapsuleGeometry(half_width_m, half) : new Px.PxBoxGeometry(half, half_width_m, DEPTH);
      for (const { x, y, half, angle } of boxes(points_m)) add("createRigidStatic", geometry(half), x, y, angle);
      const disc = add("createRigidDynamic", new Px.PxSphereGeometry(radius_m), ...position_m, 0, (body) => {
        Px.PxRigidBodyExt.prototype.setMassAndUpdateInertia(body, MASS);
        [body.setLinearDamping(0), body.setAngularDamping(0), body.setSleepThreshold(0)];
        for (const flag of [Lock.eLOCK_LINEAR_Z, Lock.eLOCK_ANGULAR_X, Lock.eLOCK_ANGULAR_Y, Lock.eLOCK_ANGULAR_Z])
          body.setRigidDynamicLockFlag(flag, true);
        if (swept) body.setRigidBodyFlag(Flag.eENABLE_CCD, true);
        body.setLinearVelocity(new Px.PxVec3(...velocity_m_s, 0));
      });
      for (let k = 0; k < steps; k++) {
        scene.simulate(dt_s);
        scene.fetchResults(true);
      }
      const [{ p }, v] = [disc.getGlobalPose(), disc.getLinearVelocity()];
      const end = [p.x, p.y, v.x, v.y];
      scene.release();
      return end;
    };
  },
  async "cannon-es"() {
    const { Body, Box, Sphere, Vec3, World } = await import("cannon-es");
    return ({ dt_s, steps, position_m, velocity_m_s, radius_m, points_m, half_width_m }) => {
      const world = new World({ gravity: new Vec3(0, 0, 0) });
      [world.defaultContactMaterial.friction, world.defaultContactMaterial.restitution] = [0, 1];
      for (const { x, y, half, angle } of boxes(points_m)) {
        const wall = new Body({ mass: 0, shape: new Box(new Vec3(half, half_width_m, DEPTH)), position: new Vec3(x, y, 0) });
        wall.quaternion.setFromAxisAngle(new Vec3(0, 0, 1), angle);
        world.addBody(wall);
      }
      const disc = new Body({
        mass: MASS, shape: new Sphere(radius_m), position: new Vec3(...position_m, 0), velocity: new Vec3(...velocity_m_s, 0),
        linearDamping: 0, fixedRotation: true, linearFactor: new Vec3(1, 1, 0),
      });
      world.addBody(disc);
      for (let k = 0; k < steps; k++) world.step(dt_s);
      return [disc.position.x, disc.position.y, disc.velocity.x, disc.velocity.y];
    };
  },
};

const fly = await ENGINES[name]();
const ends = JSON.parse(readFileSync(0, "utf8")).map(fly);
process.stdout.write(JSON.stringify(ends), () => process.exit(0));
