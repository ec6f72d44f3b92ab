// Jolt as WebAssembly: spheres that stay in a plane, with 32-bit floats.
import createJolt from "jolt-physics";
import { barsOf, Clock, contactOf, isDriven, isImmovable, Legs, reach, serve, thicknessOf, velocityOf, wallAt, wallBody } from "../serve.mjs";

const Jolt = await createJolt();
const STEPPING = [
  "mSpeculativeContactDistance", "mPenetrationSlop", "mMinVelocityForRestitution", "mNumVelocitySteps", "mNumPositionSteps",
  "mLinearCastThreshold", "mLinearCastMaxPenetration",
];
const OF_BODIES = ["mLinearDamping", "mMaxLinearVelocity", "mAllowSleeping"];
const [FIXED, MOVING] = [0, 1]; // numbers of the collision layers

// Call `use` with an object, release the object, and return the result of the call.
function using(object, use) {
  const result = use(object);
  Jolt.destroy(object);
  return result;
}

function createInterface(bodies) {
  const settings = new Jolt.JoltSettings();
  settings.mMaxBodies = bodies;
  const pairs = new Jolt.ObjectLayerPairFilterTable(2);
  pairs.EnableCollision(FIXED, MOVING);
  pairs.EnableCollision(MOVING, MOVING);
  const layers = new Jolt.BroadPhaseLayerInterfaceTable(2, 2);
  for (const layer of [FIXED, MOVING]) using(new Jolt.BroadPhaseLayer(layer), (one) => layers.MapObjectToBroadPhaseLayer(layer, one));
  settings.mObjectLayerPairFilter = pairs;
  settings.mBroadPhaseLayerInterface = layers;
  settings.mObjectVsBroadPhaseLayerFilter = new Jolt.ObjectVsBroadPhaseLayerFilterTable(layers, 2, pairs, 2);
  return using(settings, (all) => new Jolt.JoltInterface(all)); // the interface now owns the tables and releases them
}

class JoltWorld {
  constructor(scene, settings) {
    this.asked = settings;
    this.scene = scene;
    this.clock = new Clock(settings.dt_s);
    this.jolt = createInterface(scene.discs.length + scene.walls.length + 1);
    this.system = this.jolt.GetPhysicsSystem();
    const stepping = this.system.GetPhysicsSettings();
    for (const name of STEPPING) stepping[name] = settings[name];
    this.system.SetPhysicsSettings(stepping);
    using(new Jolt.Vec3(...scene.gravity_m_s2, 0), (g) => this.system.SetGravity(g));
    this.numbers = new Map(); // numbers of bodies, by their address
    this.legs = new Legs();
    this.bodies = scene.discs.map((disc, i) => this.addDisc(disc, i));
    const extent = reach(scene, settings.dt_s);
    scene.walls.forEach((wall, k) => this.addWall(wall, extent, k));
    this.contacts = [];
    // Jolt uses the larger of two bodies' restitutions. If the wall's restitution is smaller, a listener sets the
    // restitution in each contact.
    if (scene.walls.some(({ restitution = scene.wall_restitution }) => restitution < scene.restitution)) this.listen();
  }

  addBody(shape, [x, y], type, of, number, set) {
    const [position, rotation] = [new Jolt.RVec3(x, y, 0), new Jolt.Quat(0, 0, 0, 1)];
    const layer = type === Jolt.EMotionType_Dynamic ? MOVING : FIXED;
    const creation = new Jolt.BodyCreationSettings(shape, position, rotation, type, layer);
    creation.mFriction = 0;
    if (type !== Jolt.EMotionType_Static) {
      for (const name of OF_BODIES) creation[name] = this.asked[name];
      using(new Jolt.Vec3(...velocityOf(of), 0), (velocity) => (creation.mLinearVelocity = velocity));
    }
    set(creation);
    const bodies = this.system.GetBodyInterface();
    const body = bodies.CreateBody(creation);
    bodies.AddBody(body.GetID(), Jolt.EActivation_Activate);
    for (const object of [creation, position, rotation]) Jolt.destroy(object);
    this.numbers.set(Jolt.getPointer(body), number);
    this.legs.add(of, (told) => {
      bodies.ActivateBody(body.GetID());
      using(new Jolt.Vec3(...told, 0), (velocity) => bodies.SetLinearVelocity(body.GetID(), velocity));
    });
    return body;
  }

  addDisc(disc, i) {
    const held = disc.driven ? Jolt.EMotionType_Kinematic : Jolt.EMotionType_Static;
    const type = isImmovable(disc) ? held : Jolt.EMotionType_Dynamic;
    return this.addBody(new Jolt.SphereShape(disc.radius_m), disc.position_m, type, disc, i, (creation) => {
      creation.mRestitution = this.scene.restitution;
      if (isImmovable(disc)) return;
      creation.mEnhancedInternalEdgeRemoval = this.asked.mEnhancedInternalEdgeRemoval;
      creation.mAllowedDOFs = Jolt.EAllowedDOFs_TranslationX | Jolt.EAllowedDOFs_TranslationY;
      creation.mMotionQuality = this.asked.linearCast ? Jolt.EMotionQuality_LinearCast : Jolt.EMotionQuality_Discrete;
      creation.mOverrideMassProperties = Jolt.EOverrideMassProperties_CalculateInertia;
      creation.mMassPropertiesOverride.mMass = disc.mass_kg;
    });
  }

  addWall(wall, extent, k) {
    const type = isDriven(wall) ? Jolt.EMotionType_Kinematic : Jolt.EMotionType_Static;
    const [shape, place] = this.shapeOf(wall, extent);
    const { restitution = this.scene.wall_restitution } = wall;
    this.addBody(shape, place, type, wall, wallBody(k), (creation) => (creation.mRestitution = restitution));
  }

  // Return the shape of a wall, and the position of its body.
  shapeOf(wall, extent) {
    if (wall.centre_m) return [new Jolt.SphereShape(thicknessOf(this.scene, wall)), wall.centre_m];
    if (wall.points_m) return [this.capsulesOf(wall), [0, 0]];
    const { point, size } = wallAt(wall, extent);
    const [nx, ny] = wall.normal;
    if (isDriven(wall)) return [this.boxOf(wall.normal, size), point]; // in Jolt, a plane can't move
    const plane = using(new Jolt.Vec3(nx, ny, 0), (normal) => new Jolt.Plane(normal, 0));
    return [using(plane, (one) => new Jolt.PlaneShape(one, undefined, 2 * size)), point];
  }

  // Return one compound shape for a chain, since Jolt removes bumps at joints only between parts of one shape.
  capsulesOf(wall) {
    const radius = thicknessOf(this.scene, wall);
    const parts = barsOf(wall).map(({ middle, half, angle }) => [new Jolt.CapsuleShape(half, radius), middle, angle - Math.PI / 2]);
    return this.compoundOf(parts);
  }

  // Return a box whose face goes through the body's origin.
  boxOf([nx, ny], size) {
    const box = using(new Jolt.Vec3(size, size, size), (half) => new Jolt.BoxShape(half, 0));
    return this.compoundOf([[box, [-nx * size, -ny * size], Math.atan2(ny, nx)]]);
  }

  compoundOf(parts) {
    const compound = new Jolt.StaticCompoundShapeSettings();
    for (const [shape, [x, y], angle] of parts)
      using(new Jolt.Quat(0, 0, Math.sin(angle / 2), Math.cos(angle / 2)), (turn) =>
        using(new Jolt.Vec3(x, y, 0), (place) => compound.AddShapeShape(place, turn, shape, 0)),
      );
    return compound.Create().Get();
  }

  get settings() {
    const stepping = this.system.GetPhysicsSettings();
    return { ...this.asked, ...Object.fromEntries(STEPPING.map((name) => [name, stepping[name]])), dt_s: this.clock.dt };
  }

  step() {
    this.contacts.length = 0;
    this.legs.begin(this.clock.now);
    this.jolt.Step(this.clock.dt, this.asked.collisionSteps);
    this.clock.steps++;
  }

  observe() {
    if (!this.listener) this.listen();
    const pair = (vector) => [vector.GetX(), vector.GetY()];
    const velocity_m_s = this.bodies.map((body) => pair(body.GetLinearVelocity()));
    const most = this.asked.mMaxLinearVelocity;
    const fastest = Math.max(...velocity_m_s.map((v) => Math.hypot(...v)));
    return {
      position_m: this.bodies.map((body) => pair(body.GetPosition())),
      velocity_m_s,
      contacts: this.contacts,
      warning: fastest > most * (1 - 1e-6) ? `a disc was slowed down to ${most} m/s` : "",
    };
  }

  // Jolt reports contacts to a listener when it finds them: at the start of the step, or at the end of a cast. Jolt
  // reports no impulses.
  listen() {
    const { restitution, wall_restitution, walls } = this.scene;
    const ofPair = (body) => (body < 0 ? (walls[wallBody(body)].restitution ?? wall_restitution) : restitution);
    const tell = (first, second, told, settings) => {
      const [a, b] = [this.numbers.get(first), this.numbers.get(second)];
      const normal = Jolt.wrapPointer(told, Jolt.ContactManifold).mWorldSpaceNormal;
      Jolt.wrapPointer(settings, Jolt.ContactSettings).mCombinedRestitution = ofPair(Math.min(a, b));
      this.contacts.push(contactOf(a, b, this.clock.now, normal.GetX(), normal.GetY()));
    };
    this.listener = new Jolt.ContactListenerJS();
    this.listener.OnContactValidate = () => Jolt.ValidateResult_AcceptAllContactsForThisBodyPair;
    this.listener.OnContactAdded = this.listener.OnContactPersisted = tell;
    this.listener.OnContactRemoved = () => {};
    this.system.SetContactListener(this.listener);
  }

  free() {
    Jolt.destroy(this.jolt);
    if (this.listener) Jolt.destroy(this.listener);
  }
}

await serve(JoltWorld);
