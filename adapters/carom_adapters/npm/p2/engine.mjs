// p2-es: circles, with positions and velocities as 32-bit floats.
import { Body, Broadphase, Capsule, Circle, ContactMaterial, Line, Material, Plane, World } from "p2-es";
import { barsOf, Clock, contactOf, isDriven, isImmovable, Legs, pairOf, serve, summed, thicknessOf, velocityOf, wallBody } from "../serve.mjs";

const SOLVER = ["iterations", "tolerance"];
const OF_CONTACTS = ["stiffness", "relaxation", "contactSkinSize"];
const OF_BODIES = ["ccdSpeedThreshold", "ccdIterations"];

class P2World {
  constructor(scene, settings) {
    this.scene = scene;
    this.clock = new Clock(settings.dt_s);
    this.world = new World({ gravity: scene.gravity_m_s2, islandSplit: settings.islandSplit });
    for (const name of SOLVER) this.world.solver[name] = settings[name];
    const [disc, ...ofWalls] = [new Material(), ...scene.walls.map(() => new Material())];
    const pairs = [[disc, scene.restitution]];
    scene.walls.forEach(({ restitution = scene.wall_restitution }, k) => pairs.push([ofWalls[k], restitution]));
    this.materials = pairs.map(([other, restitution]) => {
      const material = new ContactMaterial(disc, other, { friction: 0, restitution });
      for (const name of OF_CONTACTS) material[name] = settings[name];
      return material;
    });
    for (const material of this.materials) this.world.addContactMaterial(material);
    this.numbers = new Map();
    this.legs = new Legs();
    this.bodies = scene.discs.map((one, i) => this.addDisc(one, settings, disc, i));
    const walls = scene.walls.map((one, k) => this.addWall(one, ofWalls[k], k));
    this.moving = [...this.bodies, ...walls.filter((_, k) => isDriven(scene.walls[k])).flat()];
  }

  // Add a body of a disc or a wall, and the changes of its velocity if it is driven.
  add(body, of, shape, material, number) {
    this.legs.add(of, (velocity) => ([body.velocity[0], body.velocity[1]] = velocity));
    shape.material = material;
    body.addShape(shape);
    this.world.addBody(body);
    this.numbers.set(body, number);
    return body;
  }

  addDisc(disc, settings, material, i) {
    const fixed = isImmovable(disc);
    const body = new Body({
      mass: fixed ? 0 : disc.mass_kg,
      position: disc.position_m,
      velocity: velocityOf(disc),
      type: disc.driven ? Body.KINEMATIC : fixed ? Body.STATIC : Body.DYNAMIC,
      damping: settings.damping,
      ...Object.fromEntries(OF_BODIES.map((name) => [name, settings[name]])),
    });
    return this.add(body, disc, new Circle({ radius: disc.radius_m }), material, i);
  }

  addWall(wall, material, k) {
    const type = isDriven(wall) ? Body.KINEMATIC : Body.STATIC;
    return this.partsOf(wall).map(([shape, [x, y], angle]) => {
      const body = new Body({ type, position: [x, y], angle, velocity: [...velocityOf(wall)], damping: 0 });
      return this.add(body, wall, shape, material, wallBody(k));
    });
  }

  // Return shape, position and angle of each part of a wall. The y axis points to the free side of a half-plane. Each
  // piece of a chain is a line or a capsule with its own body, because in two steps a disc bounces only once off the
  // shapes of one body.
  partsOf(wall) {
    const { points_m, centre_m, point_m, normal: [nx, ny] = [], half_width_m: halfWidth = 0 } = wall;
    if (centre_m) return [[new Circle({ radius: thicknessOf(this.scene, wall) }), centre_m, 0]];
    if (!points_m) return [[new Plane(), point_m, Math.atan2(ny, nx) - Math.PI / 2]];
    return barsOf(wall).map(({ middle, half, angle }) => {
      const shape = halfWidth > 0 ? new Capsule({ length: 2 * half, radius: halfWidth }) : new Line({ length: 2 * half });
      return [shape, middle, angle];
    });
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
    this.legs.begin(this.clock.now);
    this.world.step(this.clock.dt);
    this.clock.steps++;
  }

  // p2-es finds and solves contacts at the start of the step. A contact without an impulse has no effect.
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
      contacts: summed(contacts),
    };
  }

  cut(dt) {
    this.clock.cut(dt);
  }

  // Run the three searches of p2-es for contacts, without solving contacts.
  touching() {
    const { broadphase, narrowphase } = this.world;
    const found = broadphase.getCollisionPairs(this.world);
    const pairs = found.flatMap((body, k) => (k % 2 ? [] : [[body, found[k + 1]]]));
    const met = pairs.filter((pair) => Broadphase.boundingRadiusCheck(...pair) && narrowphase.bodiesOverlap(...pair));
    return met.map((pair) => pairOf(...pair.map((body) => this.numbers.get(body))));
  }

  // Two bodies bounce only if they had no contact in the previous step. So contacts are part of a state.
  save() {
    const states = this.moving.map(({ position, velocity }) => [...position, ...velocity]);
    const pairs = this.world.narrowphase.contactEquations.map(({ bodyA, bodyB }) => [bodyA, bodyB].map((body) => body.index));
    return { time: this.clock.now, told: this.legs.told, states, pairs };
  }

  restore({ time, told, states, pairs }) {
    this.clock.restart(time);
    this.legs.told = told;
    this.moving.forEach((body, i) => {
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
