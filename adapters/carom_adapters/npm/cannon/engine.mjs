// cannon-es: spheres that stay in a plane, with 64-bit floats.
import { Body, Box, ContactMaterial, Material, Plane, Quaternion, Sphere, Vec3, World } from "cannon-es";
import { barsOf, Clock, contactOf, isDriven, isImmovable, Legs, pairOf, serve, summed, thicknessOf, velocityOf, wallBody } from "../serve.mjs";

const SOLVER = ["iterations", "tolerance"];
const OF_CONTACTS = ["contactEquationStiffness", "contactEquationRelaxation"];
const MOST_IMPULSE = 1e6; // largest impulse of a contact equation, in newton seconds; no setting changes it

class CannonWorld {
  constructor(scene, settings) {
    this.scene = scene;
    this.clock = new Clock(settings.dt_s);
    this.world = new World({ gravity: new Vec3(...scene.gravity_m_s2, 0), allowSleep: settings.allowSleep });
    for (const name of SOLVER) this.world.solver[name] = settings[name];
    this.damping = settings.linearDamping;
    const [disc, ...ofWalls] = [new Material("disc"), ...scene.walls.map(() => new Material("wall"))];
    const pairs = [[disc, scene.restitution]];
    scene.walls.forEach(({ restitution = scene.wall_restitution }, k) => pairs.push([ofWalls[k], restitution]));
    this.materials = pairs.map(([other, restitution]) => {
      const options = Object.fromEntries(OF_CONTACTS.map((name) => [name, settings[name]]));
      return new ContactMaterial(disc, other, { ...options, friction: 0, restitution });
    });
    for (const material of this.materials) this.world.addContactMaterial(material);
    this.numbers = new Map();
    this.legs = new Legs();
    this.bodies = scene.discs.map((one, i) => this.addDisc(one, disc, i));
    const walls = scene.walls.map((one, k) => this.addWall(one, ofWalls[k], k));
    this.moving = [...this.bodies, ...walls.filter((_, k) => isDriven(scene.walls[k]))];
  }

  // Add the body of a disc or a wall, and the changes of its velocity if it is driven.
  add(body, of, number) {
    this.legs.add(of, ([x, y]) => body.velocity.set(x, y, 0));
    this.world.addBody(body);
    this.numbers.set(body, number);
    return body;
  }

  addDisc(disc, material, i) {
    const fixed = isImmovable(disc);
    const body = new Body({
      mass: fixed ? 0 : disc.mass_kg,
      type: disc.driven ? Body.KINEMATIC : fixed ? Body.STATIC : Body.DYNAMIC,
      material,
      shape: new Sphere(disc.radius_m),
      position: new Vec3(...disc.position_m, 0),
      velocity: new Vec3(...velocityOf(disc), 0),
      linearDamping: this.damping,
      linearFactor: new Vec3(1, 1, 0),
    });
    return this.add(body, disc, i);
  }

  addWall(wall, material, k) {
    const place = new Vec3(...(wall.point_m ?? wall.centre_m ?? [0, 0]), 0);
    const type = isDriven(wall) ? Body.KINEMATIC : Body.STATIC;
    const body = new Body({ mass: 0, type, material, position: place, velocity: new Vec3(...velocityOf(wall), 0) });
    if (wall.points_m) this.addBars(body, wall);
    else body.addShape(wall.centre_m ? new Sphere(thicknessOf(this.scene, wall)) : new Plane());
    // The z axis of the body points to the free side of a half-space.
    if (wall.normal) body.quaternion.setFromVectors(new Vec3(0, 0, 1), new Vec3(...wall.normal, 0));
    return this.add(body, wall, wallBody(k));
  }

  // Add a box for each piece, which is deeper than a disc, and a ball at each point of the wall. cannon-es has no
  // capsules.
  addBars(body, wall) {
    const [radius, depth] = [thicknessOf(this.scene, wall), 2 * Math.max(...this.scene.discs.map((disc) => disc.radius_m))];
    for (const { middle, half, angle } of barsOf(wall)) {
      const turn = new Quaternion().setFromAxisAngle(new Vec3(0, 0, 1), angle);
      body.addShape(new Box(new Vec3(half, radius, depth)), new Vec3(...middle, 0), turn);
    }
    for (const point of wall.points_m) body.addShape(new Sphere(radius), new Vec3(...point, 0));
  }

  get settings() {
    const { solver, allowSleep } = this.world;
    const found = { dt_s: this.clock.dt, allowSleep, linearDamping: this.bodies[0].linearDamping };
    for (const name of SOLVER) found[name] = solver[name];
    for (const name of OF_CONTACTS) found[name] = this.materials[0][name];
    return found;
  }

  step() {
    this.legs.begin(this.clock.now);
    this.world.step(this.clock.dt);
    this.clock.steps++;
  }

  // cannon-es finds and solves contacts at the start of the step. A contact without an impulse has no effect.
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
      contacts: summed(contacts),
      warning: most > MOST_IMPULSE * (1 - 1e-9) ? `an impulse was cut to ${MOST_IMPULSE} N s` : "",
    };
  }

  cut(dt) {
    this.clock.cut(dt);
  }

  // Run both searches of cannon-es for contacts, without solving contacts.
  touching() {
    const [first, second, found] = [[], [], []];
    this.world.broadphase.collisionPairs(this.world, first, second);
    this.world.narrowphase.getContacts(first, second, this.world, found, [], [], []);
    return found.map(({ bi, bj }) => pairOf(this.numbers.get(bi), this.numbers.get(bj)));
  }

  save() {
    const states = this.moving.map(({ position: p, velocity: v }) => [p.x, p.y, v.x, v.y]);
    return { time: this.clock.now, told: this.legs.told, states };
  }

  restore({ time, told, states }) {
    this.clock.restart(time);
    this.legs.told = told;
    this.moving.forEach((body, i) => {
      const [x, y, vx, vy] = states[i];
      body.position.set(x, y, 0);
      body.velocity.set(vx, vy, 0);
    });
  }
}

await serve(CannonWorld);
