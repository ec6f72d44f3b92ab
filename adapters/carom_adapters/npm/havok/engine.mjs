// Havok as WebAssembly, in the build of Babylon.js: spheres in a plane, with 32-bit floats.
import { readFileSync } from "node:fs";
import { createRequire } from "node:module";
import { pathToFileURL } from "node:url";
import createHavok from "@babylonjs/havok";
import { barsOf, Clock, contactOf, isDriven, isImmovable, Legs, reach, serve, thicknessOf, velocityOf, wallAt, wallBody } from "../serve.mjs";

// The WebAssembly file is read here, since the library would load it with fetch(), which does not work in Node.
const library = pathToFileURL(createRequire(import.meta.url).resolve("@babylonjs/havok"));
const HK = await createHavok({ wasmBinary: readFileSync(new URL("../esm/HavokPhysics.wasm", library)) });
const { GEOMETRIC_MEAN, MAXIMUM, MINIMUM } = HK.MaterialCombine;
const EVENTS = 1 | 2; // types of events: a collision begins, or a collision continues

// Havok's functions return a result code, and most of them also a value.
function value([result, found]) {
  if (result !== HK.Result.RESULT_OK) throw new Error(`Havok refused a call: ${result?.value}`);
  return found;
}

class HavokWorld {
  constructor(scene, settings) {
    this.asked = settings;
    this.scene = scene;
    this.clock = new Clock(settings.dt_s);
    this.scale = settings.units_per_m;
    this.world = value(HK.HP_World_Create());
    HK.HP_World_SetGravity(this.world, this.at(scene.gravity_m_s2));
    HK.HP_World_SetIdealStepTime(this.world, settings.idealStepTime);
    const [, , turning] = HK.HP_World_GetSpeedLimit(this.world);
    HK.HP_World_SetSpeedLimit(this.world, settings.maxLinearVelocity * this.scale, turning);
    this.numbers = new Map(); // numbers of bodies, by their handle
    this.legs = new Legs();
    this.shapes = [];
    this.bodies = scene.discs.map((disc, i) => this.addDisc(disc, i));
    const extent = reach(scene, settings.dt_s);
    this.walls = scene.walls.flatMap((wall, k) => this.addWall(wall, extent, k));
  }

  // Convert a point or a velocity to Havok's units, and back.
  at([x, y]) {
    return [x * this.scale, y * this.scale, 0];
  }

  from([x, y]) {
    return [x / this.scale, y / this.scale];
  }

  addBody(shape, restitution, combine, type, position, turn, number, set = () => {}) {
    HK.HP_Shape_SetMaterial(shape, [0, 0, restitution, MINIMUM, combine]);
    const body = value(HK.HP_Body_Create());
    HK.HP_Body_SetShape(body, shape);
    HK.HP_Body_SetMotionType(body, type);
    set(body);
    HK.HP_Body_SetQTransform(body, [this.at(position), turn]);
    HK.HP_Body_SetEventMask(body, EVENTS);
    HK.HP_World_AddBody(this.world, body, false);
    this.numbers.set(body[0], number);
    this.shapes.push(shape);
    return body;
  }

  addDisc(disc, i) {
    const movable = !isImmovable(disc);
    const shape = value(HK.HP_Shape_CreateSphere([0, 0, 0], disc.radius_m * this.scale));
    const held = disc.driven ? HK.MotionType.KINEMATIC : HK.MotionType.STATIC;
    const type = movable ? HK.MotionType.DYNAMIC : held;
    const set = (body) => {
      if (!movable) return;
      const [centre, , inertia, axes] = value(HK.HP_Shape_BuildMassProperties(shape));
      // the disc can't turn, so its moment of inertia need not be set
      HK.HP_Body_SetMassProperties(body, [centre, disc.mass_kg, inertia, axes]);
      HK.HP_Body_SetLinearDamping(body, this.asked.linearDamping);
      if (!this.asked.canSleep) HK.HP_Body_SetActivationControl(body, HK.ActivationControl.ALWAYS_ACTIVE);
    };
    const body = this.addBody(shape, this.scene.restitution, GEOMETRIC_MEAN, type, disc.position_m, [0, 0, 0, 1], i, set);
    if (movable || disc.driven) this.drive(body, disc);
    return body;
  }

  // Set the velocity of the body of a disc or a wall, and add the changes of its velocity.
  drive(body, of) {
    const tell = (velocity) => HK.HP_Body_SetLinearVelocity(body, this.at(velocity));
    tell(velocityOf(of));
    this.legs.add(of, tell);
  }

  addWall(wall, extent, k) {
    const { restitution = this.scene.wall_restitution } = wall;
    // for restitution, the rule of a wall has precedence over the rule of a disc
    const combine = restitution < this.scene.restitution ? MINIMUM : MAXIMUM;
    const type = isDriven(wall) ? HK.MotionType.KINEMATIC : HK.MotionType.STATIC;
    return this.shapesOf(wall, extent).map(([shape, place, angle]) => {
      const turn = [0, 0, Math.sin(angle / 2), Math.cos(angle / 2)];
      const body = this.addBody(value(shape), restitution, combine, type, place, turn, wallBody(k));
      if (isDriven(wall)) this.drive(body, wall);
      return body;
    });
  }

  // Return the shapes of a wall. Havok has no half-plane, so a half-plane is a box that is as deep as it is long. The
  // box's face goes through the body's origin. A chain has a capsule for each piece.
  shapesOf(wall, extent) {
    if (wall.normal) {
      const { point, size } = wallAt(wall, extent);
      const [half, [nx, ny]] = [size * this.scale, wall.normal];
      const box = HK.HP_Shape_CreateBox([-half, 0, 0], [0, 0, 0, 1], [2 * half, 2 * half, 2 * half]);
      return [[box, point, Math.atan2(ny, nx)]];
    }
    const radius = thicknessOf(this.scene, wall) * this.scale;
    if (wall.centre_m) return [[HK.HP_Shape_CreateSphere([0, 0, 0], radius), wall.centre_m, 0]];
    const capsule = (half) => HK.HP_Shape_CreateCapsule([-half * this.scale, 0, 0], [half * this.scale, 0, 0], radius);
    return barsOf(wall).map(({ middle, half, angle }) => [capsule(half), middle, angle]);
  }

  get settings() {
    const [, limit] = HK.HP_World_GetSpeedLimit(this.world);
    const movable = this.bodies[this.scene.discs.findIndex((disc) => !isImmovable(disc))];
    const linearDamping = movable ? value(HK.HP_Body_GetLinearDamping(movable)) : this.asked.linearDamping;
    return { ...this.asked, linearDamping, maxLinearVelocity: limit / this.scale, dt_s: this.clock.dt };
  }

  step() {
    this.legs.begin(this.clock.now);
    HK.HP_World_Step(this.world, this.clock.dt);
    this.clock.steps++;
  }

  observe() {
    const velocity_m_s = this.bodies.map((body, i) =>
      isImmovable(this.scene.discs[i]) && !this.scene.discs[i].driven ? [0, 0] : this.from(value(HK.HP_Body_GetLinearVelocity(body))),
    );
    const most = this.asked.maxLinearVelocity;
    const fastest = Math.max(...velocity_m_s.map((v) => Math.hypot(...v)));
    return {
      position_m: this.bodies.map((body) => this.from(value(HK.HP_Body_GetQTransform(body))[0])),
      velocity_m_s,
      contacts: this.contacts(),
      warning: fastest > most * (1 - 1e-6) ? `a disc was slowed down to ${most} m/s` : "",
    };
  }

  // Havok reports the impulse of the step for each pair. The normal is reported with the contact point of each body.
  contacts() {
    const found = [];
    const next = (event) => HK.HP_World_GetNextCollisionEvent(Number(this.world[0]), event);
    const [, begin] = HK.HP_World_GetCollisionEvents(this.world); // if there are no events, Havok returns 0 and an error code
    for (let event = begin; event; event = next(event)) {
      const [, first, second, impulse] = value(HK.HP_Event_AsCollision(event));
      if (!(impulse > 0)) continue;
      const [a, b] = [first, second].map(([body]) => this.numbers.get(body[0]));
      found.push(contactOf(a, b, this.clock.stepBegan, ...first[4].slice(0, 2)));
    }
    return found;
  }

  free() {
    for (const body of [...this.bodies, ...this.walls]) {
      HK.HP_World_RemoveBody(this.world, body);
      HK.HP_Body_Release(body);
    }
    for (const shape of this.shapes) HK.HP_Shape_Release(shape);
    HK.HP_World_Release(this.world);
  }
}

await serve(HavokWorld);
