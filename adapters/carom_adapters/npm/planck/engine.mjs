// Planck (planck.js), Box2D 2.3 in JavaScript with 64-bit numbers.
import { Box, Circle, Settings, Vec2, World } from "planck";
import { Clock, contactOf, isImmovable, pairOf, reach, serve, wallAt, wallBody } from "../serve.mjs";

// Constants of the library, which all worlds share; those of a world are put in place before each of its steps.
const CONSTANTS = ["linearSlop", "velocityThreshold", "maxTranslation"];
// What a shape is to others, and what it meets.
const AMONG_DISCS = [1, 1];
const BEFORE_WALLS = [2, 4];
const WALL = [4, 2];
const BOTH = [3, 5];

class PlanckWorld {
  constructor(scene, settings) {
    this.constants = Object.fromEntries(CONSTANTS.map((name) => [name, settings[name]]));
    Object.assign(Settings, this.constants);
    const { velocityIterations, positionIterations, allowSleep, warmStarting, continuousPhysics } = settings;
    const own = { velocityIterations, positionIterations, allowSleep, warmStarting, continuousPhysics };
    this.world = new World({ gravity: new Vec2(...scene.gravity_m_s2), ...own });
    this.clock = new Clock(settings.dt_s);
    this.bullet = settings.bullet;
    this.polygonRadius = settings.polygonRadius;
    this.bodies = scene.discs.map((disc, i) => this.addDisc(scene, disc, i));
    const extent = reach(scene, settings.dt_s);
    scene.walls.forEach((wall, k) => this.addWall(scene, wallAt(wall, extent), wall.normal, k));
    this.solved = null;
  }

  addDisc(scene, disc, i) {
    const body = this.world.createBody({
      type: isImmovable(disc) ? "static" : "dynamic",
      position: new Vec2(...disc.position_m),
      linearVelocity: new Vec2(...disc.velocity_m_s),
      fixedRotation: true,
      bullet: this.bullet,
      userData: i,
    });
    // Planck takes the larger of two restitutions: a disc needs a shape of none for walls whose own is the smaller one.
    const shape = new Circle(disc.radius_m);
    const apart = scene.walls.length > 0 && scene.wall_restitution < scene.restitution;
    const parts = apart ? [[AMONG_DISCS, scene.restitution], [BEFORE_WALLS, 0]] : [[BOTH, scene.restitution]];
    for (const [[filterCategoryBits, filterMaskBits], restitution] of parts)
      body.createFixture({ shape, density: 1, friction: 0, restitution, filterCategoryBits, filterMaskBits });
    if (!isImmovable(disc)) body.setMassData({ mass: disc.mass_kg, center: Vec2.zero(), I: 0 });
    return body;
  }

  // Planck has no half-plane, and through an edge fast discs pass: a square is as deep as it is long.
  addWall(scene, { point, size }, [nx, ny], k) {
    const body = this.world.createBody({ position: new Vec2(...point), userData: wallBody(k) });
    const shape = new Box(size, size, new Vec2(-nx * size, -ny * size), Math.atan2(ny, nx));
    shape.m_radius = this.polygonRadius; // its skin: as shipped, twice the slop
    const restitution = scene.wall_restitution;
    const [filterCategoryBits, filterMaskBits] = WALL;
    body.createFixture({ shape, friction: 0, restitution, filterCategoryBits, filterMaskBits });
  }

  get settings() {
    return {
      ...this.constants,
      dt_s: this.clock.dt,
      velocityIterations: this.world.m_velocityIterations,
      positionIterations: this.world.m_positionIterations,
      allowSleep: this.world.getAllowSleeping(),
      warmStarting: this.world.getWarmStarting(),
      continuousPhysics: this.world.getContinuousPhysics(),
      bullet: this.bullet,
      polygonRadius: this.polygonRadius,
    };
  }

  step() {
    Object.assign(Settings, this.constants);
    if (this.solved) this.solved.length = 0;
    this.world.step(this.clock.dt);
    this.clock.steps++;
  }

  // The first look begins to listen: a world that is only timed does not.
  observe() {
    if (!this.solved) this.listen();
    const velocities = this.bodies.map((body) => body.getLinearVelocity());
    const moved = Math.max(...velocities.map((v) => v.length())) * this.clock.dt;
    return {
      position_m: this.bodies.map((body) => [body.getPosition().x, body.getPosition().y]),
      velocity_m_s: velocities.map(({ x, y }) => [x, y]),
      contacts: this.solved,
      // A body that would move farther is slowed down to that, to rounding.
      warning: moved > this.constants.maxTranslation * (1 - 1e-9) ? `a disc was slowed down to ${this.constants.maxTranslation} m a step` : "",
    };
  }

  listen() {
    this.solved = [];
    const bodiesOf = (contact) => [contact.getFixtureA(), contact.getFixtureB()].map((fixture) => fixture.getBody());
    const normals = new Map();
    // After the solution the bodies have moved on, and the manifold's normal with them.
    this.world.on("pre-solve", (contact) => {
      const { x, y } = contact.getWorldManifold(null).normal;
      normals.set(contact, [x, y]);
    });
    this.world.on("post-solve", (contact, { normalImpulses }) => {
      const impulse = normalImpulses[0] + normalImpulses[1];
      if (!(impulse > 0)) return; // it tells of a contact for as long as it lasts
      const [a, b] = bodiesOf(contact);
      // Where all are bullets, its own time of impact counts, a part of the step, which its bodies were moved by.
      const time = this.clock.now + (this.bullet ? a.m_sweep.alpha0 * this.clock.dt : 0);
      this.solved.push(contactOf(a.getUserData(), b.getUserData(), time, ...normals.get(contact), impulse));
    });
  }

  cut(dt) {
    this.clock.cut(dt);
  }

  // A step of no length looks for contacts, and moves and solves nothing.
  touching() {
    Object.assign(Settings, this.constants);
    this.world.step(0);
    const pairs = [];
    for (let contact = this.world.getContactList(); contact; contact = contact.getNext())
      if (contact.isTouching())
        pairs.push(pairOf(contact.getFixtureA().getBody().getUserData(), contact.getFixtureB().getBody().getUserData()));
    return pairs;
  }

  save() {
    const bodies = this.bodies.map((body) => [body.getPosition(), body.getLinearVelocity()].map(({ x, y }) => [x, y]));
    return { time: this.clock.now, bodies };
  }

  restore({ time, bodies }) {
    this.clock.restart(time);
    this.bodies.forEach((body, i) => {
      body.setTransform(new Vec2(...bodies[i][0]), 0);
      body.setLinearVelocity(new Vec2(...bodies[i][1]));
    });
  }
}

await serve(PlanckWorld);
