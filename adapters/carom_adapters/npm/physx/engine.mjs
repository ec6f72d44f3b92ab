// PhysX 5 as WebAssembly, fabmax's build: spheres held in a plane, with 32-bit floats.
import { readFileSync } from "node:fs";
import { createRequire } from "node:module";
import { Clock, contactOf, isImmovable, serve, wallBody } from "../serve.mjs";

// The build is for browsers, and refuses to start where it sees node; what it prints is not for standard output.
const library = createRequire(import.meta.url).resolve("physx-js-webidl");
const { versions } = process;
Object.defineProperty(process, "versions", { value: { ...versions, node: undefined } });
globalThis.window = globalThis;
globalThis.document = { currentScript: null };
const { default: create } = await import(library);
const wasmBinary = readFileSync(library.replace(/\.mjs$/, ".wasm"));
const Px = await create({ wasmBinary, print: console.error, printErr: console.error });
Object.defineProperty(process, "versions", { value: versions });

const MOST_POINTS = 16; // of a pair; two spheres have one
const top = Px.PxTopLevelFunctions.prototype;
const foundation = top.CreateFoundation(Px.PHYSICS_VERSION, new Px.PxDefaultAllocator(), new Px.PxDefaultErrorCallback());
const scale = new Px.PxTolerancesScale();
const physics = top.CreatePhysics(Px.PHYSICS_VERSION, foundation, scale);
const dispatcher = top.DefaultCpuDispatcherCreate(0);
const points = new Px.Vector_PxContactPairPoint(MOST_POINTS).data();
const { PxPairFlagEnum: Pair, PxCombineModeEnum: Combine, PxRigidDynamicLockFlagEnum: Lock } = Px;
const LOCKED = [Lock.eLOCK_LINEAR_Z, Lock.eLOCK_ANGULAR_X, Lock.eLOCK_ANGULAR_Y, Lock.eLOCK_ANGULAR_Z];

// What `use` makes of an object, whose memory is then given back.
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
    this.numbers = new Map(); // by the bodies' addresses
    this.makeScene();
    const material = (restitution, combine) => {
      const made = physics.createMaterial(0, 0, restitution);
      made.setRestitutionCombineMode(combine);
      return made;
    };
    // Of two ways to combine the later one of average, least, product and most is taken: a wall's.
    const { restitution, wall_restitution } = scene;
    const [disc, wall] = [material(restitution, Combine.eAVERAGE), material(wall_restitution, wall_restitution < restitution ? Combine.eMIN : Combine.eMAX)];
    this.materials = [disc, wall];
    this.bodies = scene.discs.map((one, i) => this.addDisc(one, disc, i));
    this.walls = scene.walls.map((one, k) => this.addWall(one, wall, k));
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
    if (isImmovable(disc)) return this.add("createRigidStatic", disc.position_m, 0, sphere, material, i);
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

  // A half-space, whose outside is where the body's x axis points.
  addWall({ point_m, normal: [nx, ny] }, material, k) {
    return this.add("createRigidStatic", point_m, Math.atan2(ny, nx), new Px.PxPlaneGeometry(), material, wallBody(k));
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
      const { impulse, normal } = points; // its normal is from the second to the first
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
        if (isImmovable(this.scene.discs[i])) return [0, 0];
        const { x, y } = body.getLinearVelocity();
        return [x, y];
      }),
      contacts: this.told,
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
