// cannon-es: spheres held in a plane, with 64-bit numbers.
import { Body, ContactMaterial, Material, Plane, Sphere, Vec3, World } from "cannon-es";
import { Clock, contactOf, isImmovable, pairOf, serve, wallBody } from "../serve.mjs";

const SOLVER = ["iterations", "tolerance"];
const OF_CONTACTS = ["contactEquationStiffness", "contactEquationRelaxation"];
const MOST_IMPULSE = 1e6; // N s: as much as an equation of contact gives, which nothing sets

class CannonWorld {
  constructor(scene, settings) {
    this.scene = scene;
    this.clock = new Clock(settings.dt_s);
    this.world = new World({ gravity: new Vec3(...scene.gravity_m_s2, 0), allowSleep: settings.allowSleep });
    for (const name of SOLVER) this.world.solver[name] = settings[name];
    this.damping = settings.linearDamping;
    const [disc, wall] = [new Material("disc"), new Material("wall")];
    const pairs = [[disc, scene.restitution], [wall, scene.wall_restitution]];
    this.materials = pairs.map(([other, restitution]) => {
      const options = Object.fromEntries(OF_CONTACTS.map((name) => [name, settings[name]]));
      return new ContactMaterial(disc, other, { ...options, friction: 0, restitution });
    });
    for (const material of this.materials) this.world.addContactMaterial(material);
    this.numbers = new Map();
    this.bodies = scene.discs.map((one, i) => this.addDisc(one, disc, i));
    scene.walls.forEach((one, k) => this.addWall(one, wall, k));
  }

  add(body, number) {
    this.world.addBody(body);
    this.numbers.set(body, number);
    return body;
  }

  addDisc(disc, material, i) {
    const fixed = isImmovable(disc);
    const body = new Body({
      mass: fixed ? 0 : disc.mass_kg, // of 0 it is static
      material,
      shape: new Sphere(disc.radius_m),
      position: new Vec3(...disc.position_m, 0),
      velocity: fixed ? new Vec3() : new Vec3(...disc.velocity_m_s, 0),
      linearDamping: this.damping,
      linearFactor: new Vec3(1, 1, 0),
    });
    return this.add(body, i);
  }

  // A half-space, whose outside is where the body's z axis points.
  addWall({ point_m, normal }, material, k) {
    const body = new Body({ mass: 0, material, shape: new Plane(), position: new Vec3(...point_m, 0) });
    body.quaternion.setFromVectors(new Vec3(0, 0, 1), new Vec3(...normal, 0));
    this.add(body, wallBody(k));
  }

  get settings() {
    const { solver, allowSleep } = this.world;
    const found = { dt_s: this.clock.dt, allowSleep, linearDamping: this.bodies[0].linearDamping };
    for (const name of SOLVER) found[name] = solver[name];
    for (const name of OF_CONTACTS) found[name] = this.materials[0][name];
    return found;
  }

  step() {
    this.world.step(this.clock.dt);
    this.clock.steps++;
  }

  // Its contacts are found where the step begins, and solved there; one that only lasts is given no impulse.
  observe() {
    const contacts = [];
    let most = 0;
    for (const { bi, bj, ni, multiplier } of this.world.contacts) {
      const impulse = multiplier * this.clock.dt;
      most = Math.max(most, impulse);
      const [a, b] = [bi, bj].map((body) => this.numbers.get(body));
      if (impulse > 0) contacts.push(contactOf(a, b, this.clock.stepBegan, ni.x, ni.y, impulse));
    }
    return {
      position_m: this.bodies.map(({ position: { x, y } }) => [x, y]),
      velocity_m_s: this.bodies.map(({ velocity: { x, y } }) => [x, y]),
      contacts,
      warning: most > MOST_IMPULSE * (1 - 1e-9) ? `an impulse was cut to ${MOST_IMPULSE} N s` : "",
    };
  }

  cut(dt) {
    this.clock.cut(dt);
  }

  // Its own two searches, of which nothing is solved.
  touching() {
    const [first, second, found] = [[], [], []];
    this.world.broadphase.collisionPairs(this.world, first, second);
    this.world.narrowphase.getContacts(first, second, this.world, found, [], [], []);
    return found.map(({ bi, bj }) => pairOf(this.numbers.get(bi), this.numbers.get(bj)));
  }

  save() {
    const states = this.bodies.map(({ position: p, velocity: v }) => [p.x, p.y, v.x, v.y]);
    return { time: this.clock.now, states };
  }

  restore({ time, states }) {
    this.clock.restart(time);
    this.bodies.forEach((body, i) => {
      const [x, y, vx, vy] = states[i];
      body.position.set(x, y, 0);
      body.velocity.set(vx, vy, 0);
    });
  }
}

await serve(CannonWorld);
