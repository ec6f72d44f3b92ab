// PhysX 5 as WebAssembly, in the build by fabmax: spheres that stay in a plane, with 32-bit floats.
import { readFileSync } from "node:fs";
import { createRequire } from "node:module";
import { barsOf, Clock, contactOf, isDriven, isImmovable, Legs, reach, serve, summed, thicknessOf, velocityOf, wallAt, wallBody } from "../serve.mjs";

// The build is for browsers, and does not start if it detects Node. The build must not write to standard output, which
// contains only answers of the protocol.
const library = createRequire(import.meta.url).resolve("physx-js-webidl");
const { versions } = process;
Object.defineProperty(process, "versions", { value: { ...versions, node: undefined } });
globalThis.window = globalThis;
globalThis.document = { currentScript: null };
const { default: create } = await import(library);
const wasmBinary = readFileSync(library.replace(/\.mjs$/, ".wasm"));
const Px = await create({ wasmBinary, print: console.error, printErr: console.error });
Object.defineProperty(process, "versions", { value: versions });

const MOST_POINTS = 16; // largest number of contact points of a pair; two spheres have one point
const top = Px.PxTopLevelFunctions.prototype;
const foundation = top.CreateFoundation(Px.PHYSICS_VERSION, new Px.PxDefaultAllocator(), new Px.PxDefaultErrorCallback());
const scale = new Px.PxTolerancesScale();
const physics = top.CreatePhysics(Px.PHYSICS_VERSION, foundation, scale);
const dispatcher = top.DefaultCpuDispatcherCreate(0);
const points = new Px.Vector_PxContactPairPoint(MOST_POINTS).data();
const { PxPairFlagEnum: Pair, PxCombineModeEnum: Combine, PxRigidDynamicLockFlagEnum: Lock } = Px;
const LOCKED = [Lock.eLOCK_LINEAR_Z, Lock.eLOCK_ANGULAR_X, Lock.eLOCK_ANGULAR_Y, Lock.eLOCK_ANGULAR_Z];

// Call `use` with an object, release the object, and return the result of the call.
function using(object, use) {
  const result = use(object);
  Px.destroy(object);
  return result;
}

class PhysxWorld {
  constructor(scene, settings) {
    this.asked = settings;
    this.scene = scene;
    this.clock = new Clock(settings.dt_s);
    this.told = [];
    this.numbers = new Map(); // numbers of bodies, by their address
    // driven bodies, each with its angle, its present velocity and a start: from the start at time 0, this velocity
    // leads to the present position
    this.driven = [];
    this.legs = new Legs();
    this.makeScene();
    const material = (restitution, combine) => {
      const made = physics.createMaterial(0, 0, restitution);
      made.setRestitutionCombineMode(combine);
      return made;
    };
    // If two bodies have different rules to combine restitutions, PhysX uses the later one in the order average,
    // minimum, multiply, maximum. The adapter gives walls the later rule.
    const disc = material(scene.restitution, Combine.eAVERAGE);
    const ofWalls = scene.walls.map(({ restitution = scene.wall_restitution }) =>
      material(restitution, restitution < scene.restitution ? Combine.eMIN : Combine.eMAX),
    );
    this.materials = [disc, ...ofWalls];
    this.bodies = scene.discs.map((one, i) => this.addDisc(one, disc, i));
    const extent = reach(scene, settings.dt_s);
    this.walls = scene.walls.flatMap((one, k) => this.addWall(one, extent, ofWalls[k], k));
  }

  makeScene() {
    const { bounceThresholdVelocity, solver, ccd } = this.asked;
    const described = new Px.PxSceneDesc(scale);
    using(new Px.PxVec3(...this.scene.gravity_m_s2, 0), (gravity) => (described.gravity = gravity));
    described.cpuDispatcher = dispatcher;
    described.bounceThresholdVelocity = bounceThresholdVelocity;
    described.solverType = Px.PxSolverTypeEnum[solver];
    if (ccd) described.flags.raise(Px.PxSceneFlagEnum.eENABLE_CCD);
    const touches = Pair.eNOTIFY_TOUCH_FOUND | Pair.eNOTIFY_TOUCH_PERSISTS | Pair.eNOTIFY_CONTACT_POINTS;
    const swept = ccd ? Pair.eDETECT_CCD_CONTACT | Pair.eNOTIFY_TOUCH_CCD : 0;
    this.shader = new Px.PassThroughFilterShaderImpl();
    this.shader.filterShader = () => {
      this.shader.outputPairFlags = Pair.eCONTACT_DEFAULT | touches | swept;
      return 0;
    };
    top.setupPassThroughFilterShader(described, this.shader);
    this.listener = new Px.PxSimulationEventCallbackImpl();
    this.listener.onContact = (header, pairs, count) => this.tell(header, pairs, count);
    for (const name of ["onConstraintBreak", "onWake", "onSleep", "onTrigger"]) this.listener[name] = () => {};
    described.simulationEventCallback = this.listener;
    this.physx = physics.createScene(described);
    Px.destroy(described);
  }

  add(create, [x, y], angle, geometry, material, number, set = () => {}) {
    const [place, turn] = [new Px.PxVec3(x, y, 0), new Px.PxQuat(0, 0, Math.sin(angle / 2), Math.cos(angle / 2))];
    const body = using(new Px.PxTransform(place, turn), (pose) => physics[create](pose));
    const flags = new Px.PxShapeFlags(Px.PxShapeFlagEnum.eSIMULATION_SHAPE);
    const shape = physics.createShape(geometry, material, true, flags);
    using(new Px.PxFilterData(1, 1, 0, 0), (data) => shape.setSimulationFilterData(data));
    shape.setContactOffset(this.asked.contactOffset);
    body.attachShape(shape);
    this.contactOffset = shape.getContactOffset();
    shape.release();
    set(body);
    this.physx.addActor(body);
    this.numbers.set(body.ptr, number);
    for (const object of [place, turn, geometry, flags]) Px.destroy(object);
    return body;
  }

  addDisc(disc, material, i) {
    const { linearDamping, positionIterations, velocityIterations, maxDepenetrationVelocity, canSleep, ccd } = this.asked;
    const sphere = new Px.PxSphereGeometry(disc.radius_m);
    if (isImmovable(disc)) return this.addHeld(disc.driven ? disc : null, disc.position_m, 0, sphere, material, i);
    return this.add("createRigidDynamic", disc.position_m, 0, sphere, material, i, (body) => {
      Px.PxRigidBodyExt.prototype.setMassAndUpdateInertia(body, disc.mass_kg);
      body.setLinearDamping(linearDamping);
      body.setSolverIterationCounts(positionIterations, velocityIterations);
      body.setMaxDepenetrationVelocity(maxDepenetrationVelocity);
      for (const flag of LOCKED) body.setRigidDynamicLockFlag(flag, true);
      if (!canSleep) body.setSleepThreshold(0);
      if (ccd) body.setRigidBodyFlag(Px.PxRigidBodyFlagEnum.eENABLE_CCD, true);
      using(new Px.PxVec3(...disc.velocity_m_s, 0), (velocity) => body.setLinearVelocity(velocity));
    });
  }

  // Add a body that is at rest or driven. PhysX gets the position of a driven body at the end of a step, and computes
  // the velocity from this position.
  addHeld(driven, place, angle, geometry, material, number) {
    if (!driven) return this.add("createRigidStatic", place, angle, geometry, material, number);
    const body = this.add("createRigidDynamic", place, angle, geometry, material, number, (one) =>
      one.setRigidBodyFlag(Px.PxRigidBodyFlagEnum.eKINEMATIC, true),
    );
    const one = { body, place, angle, velocity: velocityOf(driven) };
    this.driven.push(one);
    this.legs.add(driven, (velocity) => {
      const since = one.velocity;
      one.place = one.place.map((value, axis) => value + (since[axis] - velocity[axis]) * this.clock.now);
      one.velocity = velocity;
    });
    return body;
  }

  aim({ body, place: [x, y], angle, velocity: [vx, vy] }, time) {
    const [to, turn] = [new Px.PxVec3(x + vx * time, y + vy * time, 0), new Px.PxQuat(0, 0, Math.sin(angle / 2), Math.cos(angle / 2))];
    using(new Px.PxTransform(to, turn), (pose) => body.setKinematicTarget(pose));
    for (const object of [to, turn]) Px.destroy(object);
  }

  addWall(wall, extent, material, k) {
    const driven = isDriven(wall) ? wall : null;
    return this.shapesOf(wall, extent).map(([geometry, place, angle]) =>
      this.addHeld(driven, place, angle, geometry, material, wallBody(k)),
    );
  }

  // Return the shapes of a wall. The x axis of the body points to the free side of a half-space. A half-space can't
  // move, so a driven half-plane is a box. The box is so deep that no disc can reach its other side.
  shapesOf(wall, extent) {
    if (wall.normal) {
      const [[nx, ny], { point, size }] = [wall.normal, wallAt(wall, extent)];
      const angle = Math.atan2(ny, nx);
      if (!isDriven(wall)) return [[new Px.PxPlaneGeometry(), wall.point_m, angle]];
      return [[new Px.PxBoxGeometry(size, size, size), [point[0] - nx * size, point[1] - ny * size], angle]];
    }
    const radius = thicknessOf(this.scene, wall);
    if (wall.centre_m) return [[new Px.PxSphereGeometry(radius), wall.centre_m, 0]];
    return barsOf(wall).map(({ middle, half, angle }) => [new Px.PxCapsuleGeometry(radius, half), middle, angle]);
  }

  get settings() {
    const found = { ...this.asked, dt_s: this.clock.dt, contactOffset: this.contactOffset };
    found.bounceThresholdVelocity = this.physx.getBounceThresholdVelocity();
    const movable = this.bodies[this.scene.discs.findIndex((disc) => !isImmovable(disc))];
    if (!movable) return found;
    return { ...found, linearDamping: movable.getLinearDamping(), maxDepenetrationVelocity: movable.getMaxDepenetrationVelocity() };
  }

  step() {
    this.told.length = 0;
    this.legs.begin(this.clock.now);
    for (const one of this.driven) this.aim(one, this.clock.now + this.clock.dt);
    this.physx.simulate(this.clock.dt);
    this.physx.fetchResults(true);
    this.clock.steps++;
  }

  tell(header, pairs, count) {
    const [of, all] = [Px.wrapPointer(header, Px.PxContactPairHeader), Px.wrapPointer(pairs, Px.PxContactPair)];
    const [a, b] = [0, 1].map((k) => this.numbers.get(of.get_actors(k).ptr));
    for (let k = 0; k < count; k++) {
      const pair = Px.NativeArrayHelpers.prototype.getContactPairAt(all, k);
      if (!pair.extractContacts(points, MOST_POINTS)) continue;
      const { impulse, normal } = points; // the normal points from the second body to the first
      const push = Math.hypot(impulse.x, impulse.y);
      if (push > 0) this.told.push(contactOf(a, b, this.clock.now, -normal.x, -normal.y, push));
    }
  }

  observe() {
    return {
      position_m: this.bodies.map((body) => {
        const { p } = body.getGlobalPose();
        return [p.x, p.y];
      }),
      velocity_m_s: this.bodies.map((body, i) => {
        if (isImmovable(this.scene.discs[i])) return this.driven.find((one) => one.body === body)?.velocity ?? [0, 0];
        const { x, y } = body.getLinearVelocity();
        return [x, y];
      }),
      contacts: summed(this.told),
    };
  }

  free() {
    for (const body of [...this.bodies, ...this.walls]) body.release();
    this.physx.release();
    for (const material of this.materials) material.release();
    for (const object of [this.shader, this.listener]) Px.destroy(object);
  }
}

await serve(PhysxWorld);
