// node bare_releases.mjs FOLDER ENGINE SCENES: scenes of a file in a release of matter.js, Planck or Rapier, as shipped and without
// Carom. At 32 phases of the step, as JSON: of each scene and phase, places and velocities at the end, how often the velocity of a
// disc turns by more than a hundredth from one step to the next, and, by matter.js, how often two begin to touch.
import { readFileSync } from "node:fs";
import { createRequire } from "node:module";
import { pathToFileURL } from "node:url";

const [folder, engine, scenes] = process.argv.slice(2);
const require = createRequire(`${folder}/x.cjs`);
const SCALE = 128; // pixels a metre
const FAR = 100; // m: how long and deep a wall is

function matter({ discs, walls, restitution, wall_restitution }, dt) {
  const { Bodies, Body, Composite, Engine, Events, Resolver } = require("matter-js");
  Resolver._restingThresh = 2; // as 0.20 ships it; 0.18 ships 4
  const world = Engine.create({});
  Object.assign(world.gravity ?? world.world.gravity, { x: 0, y: 0 }); // the world's until 0.16
  const grid = world.grid ?? world.broadphase;
  if (grid) grid.bucketWidth = grid.bucketHeight = 4 * FAR * SCALE; // of 48 pixels, a wall fills millions
  const bodies = discs.map(({ position_m: [x, y], velocity_m_s: [vx, vy], radius_m, mass_kg }) => {
    const free = { friction: 0, frictionStatic: 0, frictionAir: 0, restitution };
    const body = Bodies.circle(x * SCALE, y * SCALE, radius_m * SCALE, free);
    Body.setMass(body, mass_kg);
    body.deltaTime = dt * 1000;
    body.positionPrev = { x: (x - vx * dt) * SCALE, y: (y - vy * dt) * SCALE };
    return body;
  });
  const blocks = walls.map(({ point_m: [x, y], normal: [nx, ny] }) => {
    const own = { isStatic: true, restitution: wall_restitution, angle: Math.atan2(ny, nx) };
    const side = 2 * FAR * SCALE;
    return Bodies.rectangle((x - nx * FAR) * SCALE, (y - ny * FAR) * SCALE, side, side, own);
  });
  let met = 0;
  Events.on(world, "collisionStart", ({ pairs }) => {
    met += pairs.length;
    if (wall_restitution < restitution) pairs.forEach((pair) => (pair.restitution = wall_restitution)); // it takes the larger one
  });
  Composite.add(world.world, [...bodies, ...blocks]);
  const told = ({ position: { x, y }, positionPrev: old }) => [x, y, (x - old.x) / dt, (y - old.y) / dt].map((v) => v / SCALE);
  return { step: () => Engine.update(world, dt * 1000), told: () => bodies.map(told), met: () => met };
}

function planck({ discs, walls, restitution, wall_restitution }, dt) {
  const { Box, Circle, Vec2, World } = require("planck");
  const world = new World({ gravity: new Vec2(0, 0) });
  const bodies = discs.map(({ position_m, velocity_m_s, radius_m, mass_kg }) => {
    const start = { position: new Vec2(...position_m), linearVelocity: new Vec2(...velocity_m_s), fixedRotation: true };
    const body = world.createBody({ type: "dynamic", ...start });
    // Of two it takes the larger restitution: no scene with walls of less has two discs.
    const own = walls.length && wall_restitution < restitution ? 0 : restitution;
    body.createFixture({ shape: new Circle(radius_m), density: 1, friction: 0, restitution: own });
    body.setMassData({ mass: mass_kg, center: Vec2.zero(), I: 0 });
    return body;
  });
  for (const { point_m, normal: [nx, ny] } of walls) {
    const shape = new Box(FAR, FAR, new Vec2(-nx * FAR, -ny * FAR), Math.atan2(ny, nx));
    const wall = world.createBody({ type: "static", position: new Vec2(...point_m) });
    wall.createFixture({ shape, friction: 0, restitution: wall_restitution });
  }
  const told = (body) => [body.getPosition(), body.getLinearVelocity()].flatMap(({ x, y }) => [x, y]);
  return { step: () => world.step(dt), told: () => bodies.map(told) };
}

function rapier({ discs, walls, restitution }, dt) {
  if (walls.length) return null;
  const world = new RAPIER.World({ x: 0, y: 0 });
  world.timestep = dt;
  const bodies = discs.map(({ position_m, velocity_m_s, radius_m, mass_kg }) => {
    const desc = RAPIER.RigidBodyDesc.dynamic().setAdditionalMass(mass_kg).lockRotations().setCanSleep(false);
    const body = world.createRigidBody(desc.setTranslation(...position_m).setLinvel(...velocity_m_s));
    world.createCollider(RAPIER.ColliderDesc.ball(radius_m).setDensity(0).setRestitution(restitution).setFriction(0), body);
    return body;
  });
  const told = (body) => [body.translation(), body.linvel()].flatMap(({ x, y }) => [x, y]);
  return { step: () => world.step(), told: () => bodies.map(told), free: () => world.free() };
}

let RAPIER;
if (engine === "rapier") {
  const main = require.resolve("@dimforge/rapier2d-compat");
  const beside = pathToFileURL(main.replace("cjs.js", "es.js").replace("rapier.cjs", "rapier.mjs"));
  const loaded = await import(beside).catch(() => require(main));
  RAPIER = loaded.default ?? loaded;
  console.warn = () => {};
  await RAPIER.init();
}

function run(scene, phase) {
  const dt = 1 / scene.frame_rate_hz;
  const back = ({ position_m, velocity_m_s: v, ...rest }) => ({ position_m: position_m.map((x, k) => x - phase * dt * v[k]), velocity_m_s: v, ...rest });
  const world = { matter, planck, rapier }[engine]({ ...scene, discs: scene.discs.map(back) }, dt);
  if (!world) return null;
  let turns = 0;
  let last = world.told();
  for (let step = 0; step < Math.round(scene.duration_s / dt) + 1; step++) {
    world.step();
    const now = world.told();
    now.forEach(([, , x, y], k) => (turns += Math.hypot(x - last[k][2], y - last[k][3]) > 0.01 * Math.hypot(last[k][2], last[k][3])));
    last = now;
  }
  const met = world.met?.();
  world.free?.();
  return { end: last, turns, met };
}

const phases = [...Array(32).keys()].map((k) => k / 32);
const found = Object.fromEntries(JSON.parse(readFileSync(scenes)).map((scene) => [scene.name, phases.map((phase) => run(scene, phase))]));
process.stdout.write(JSON.stringify(found) + "\n");
