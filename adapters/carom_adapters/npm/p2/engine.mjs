// p2-es: circles, whose places and velocities are 32-bit numbers.
import { Body, Broadphase, Circle, ContactMaterial, Material, Plane, World } from "p2-es";
import { Clock, contactOf, isImmovable, pairOf, serve, wallBody } from "../serve.mjs";

const SOLVER = ["iterations", "tolerance"];
const OF_CONTACTS = ["stiffness", "relaxation", "contactSkinSize"];
const OF_BODIES = ["ccdSpeedThreshold", "ccdIterations"];

class P2World {
  constructor(scene, settings) {
    this.scene = scene;
    this.clock = new Clock(settings.dt_s);
    this.world = new World({ gravity: scene.gravity_m_s2, islandSplit: settings.islandSplit });
    for (const name of SOLVER) this.world.solver[name] = settings[name];
    const [disc, wall] = [new Material(), new Material()];
    const pairs = [[disc, scene.restitution], [wall, scene.wall_restitution]];
    this.materials = pairs.map(([other, restitution]) => {
      const material = new ContactMaterial(disc, other, { friction: 0, restitution });
      for (const name of OF_CONTACTS) material[name] = settings[name];
      return material;
    });
    for (const material of this.materials) this.world.addContactMaterial(material);
    this.numbers = new Map();
    this.bodies = scene.discs.map((one, i) => this.addDisc(one, settings, disc, i));
    scene.walls.forEach((one, k) => this.addWall(one, wall, k));
  }

  add(body, shape, material, number) {
    shape.material = material;
    body.addShape(shape);
    this.world.addBody(body);
    this.numbers.set(body, number);
    return body;
  }

  addDisc(disc, settings, material, i) {
    const fixed = isImmovable(disc);
    const body = new Body({
      mass: fixed ? 0 : disc.mass_kg, // of 0 it is static
      position: disc.position_m,
      velocity: fixed ? [0, 0] : disc.velocity_m_s,
      damping: settings.damping,
      ...Object.fromEntries(OF_BODIES.map((name) => [name, settings[name]])),
    });
    return this.add(body, new Circle({ radius: disc.radius_m }), material, i);
  }

  // A half-plane, whose outside is where the body's y axis points.
  addWall({ point_m, normal: [nx, ny] }, material, k) {
    const body = new Body({ position: point_m, angle: Math.atan2(ny, nx) - Math.PI / 2 });
    return this.add(body, new Plane(), material, wallBody(k));
  }

  get settings() {
    const { solver, islandSplit } = this.world;
    const found = { dt_s: this.clock.dt, islandSplit, damping: this.bodies[0].damping };
    for (const name of SOLVER) found[name] = solver[name];
    for (const name of OF_CONTACTS) found[name] = this.materials[0][name];
    for (const name of OF_BODIES) found[name] = this.bodies[0][name];
    return found;
  }

  step() {
    this.world.step(this.clock.dt);
    this.clock.steps++;
  }

  // Its contacts are found where the step begins, and solved there; one that only lasts is given no impulse.
  observe() {
    const contacts = [];
    for (const { bodyA, bodyB, normalA, multiplier } of this.world.narrowphase.contactEquations) {
      const [a, b] = [bodyA, bodyB].map((body) => this.numbers.get(body));
      const impulse = multiplier * this.clock.dt;
      if (impulse > 0) contacts.push(contactOf(a, b, this.clock.stepBegan, ...normalA, impulse));
    }
    return {
      position_m: this.bodies.map(({ position }) => [...position]),
      velocity_m_s: this.bodies.map(({ velocity }) => [...velocity]),
      contacts,
    };
  }

  cut(dt) {
    this.clock.cut(dt);
  }

  // Its own three searches, of which nothing is solved.
  touching() {
    const { broadphase, narrowphase } = this.world;
    const found = broadphase.getCollisionPairs(this.world);
    const pairs = found.flatMap((body, k) => (k % 2 ? [] : [[body, found[k + 1]]]));
    const met = pairs.filter((pair) => Broadphase.boundingRadiusCheck(...pair) && narrowphase.bodiesOverlap(...pair));
    return met.map((pair) => pairOf(...pair.map((body) => this.numbers.get(body))));
  }

  // Two bodies bounce where the step before had no contact of them, so that contacts are part of a state.
  save() {
    const states = this.bodies.map(({ position, velocity }) => [...position, ...velocity]);
    const pairs = this.world.narrowphase.contactEquations.map(({ bodyA, bodyB }) => [bodyA, bodyB].map((body) => body.index));
    return { time: this.clock.now, states, pairs };
  }

  restore({ time, states, pairs }) {
    this.clock.restart(time);
    this.bodies.forEach((body, i) => {
      const [x, y, vx, vy] = states[i];
      [body.position[0], body.position[1], body.velocity[0], body.velocity[1]] = [x, y, vx, vy];
      body.aabbNeedsUpdate = true;
    });
    const { narrowphase, bodies } = this.world;
    narrowphase.reset();
    [narrowphase.currentContactMaterial] = this.materials;
    for (const [a, b] of pairs.map((pair) => pair.map((index) => bodies[index])))
      narrowphase.contactEquations.push(narrowphase.createContactEquation(a, b, a.shapes[0], b.shapes[0]));
  }
}

await serve(P2World);
