// node matter_releases.mjs FOLDER: five equal discs in a row, bare, 60 steps a second, at 32 phases of the step, as JSON.
// Of each phase, the velocities at the end over the fastest at the start; a static body's cells in the grid, by its side;
// the inertia of a disc over mass times radius squared, as made and after `Body.setMass`.
import { createRequire } from "node:module";

const { Bodies, Body, Composite, Engine, Resolver } = createRequire(`${process.argv[2]}/x.cjs`)("matter-js");
const STEP = 1000 / 60; // ms
const SCALE = 128; // pixels a metre
Resolver._restingThresh = 2; // as 0.20 ships it; 0.18 ships 4

function sorted(phase) {
  const engine = Engine.create({});
  Object.assign(engine.gravity ?? engine.world.gravity, { x: 0, y: 0 }); // the world's until 0.16
  const at = [0, 0.65, 1.9, 2.45, 3.9];
  const velocities = [2.5, 1.6, 0.5, -0.8, -1.9];
  const discs = at.map((x, k) => {
    const a_step = (velocities[k] * SCALE) / 60; // pixels
    const own = { friction: 0, frictionStatic: 0, frictionAir: 0, restitution: 1 };
    const body = Bodies.circle(x * SCALE - phase * a_step, 0, 0.1 * SCALE, own);
    Body.setMass(body, 1);
    body.deltaTime = STEP;
    body.positionPrev = { x: body.position.x - a_step, y: body.position.y };
    return body;
  });
  Composite.add(engine.world, discs);
  for (let step = 0; step < 106; step++) Engine.update(engine, STEP);
  return discs.map((body) => ((body.position.x - body.positionPrev.x) * 60) / SCALE / 2.5);
}

function cells(side) {
  const engine = Engine.create({});
  Composite.add(engine.world, [Bodies.rectangle(-side, 0, side, side, { isStatic: true }), Bodies.circle(100, 0, 10)]);
  Engine.update(engine, STEP);
  return Object.keys((engine.grid ?? engine.broadphase)?.buckets ?? {}).length;
}

function inertia() {
  const body = Bodies.circle(0, 0, 10);
  const made = body.inertia / body.mass / 100;
  Body.setMass(body, 1);
  return [made, body.inertia / body.mass / 100];
}

const phases = [...Array(32).keys()].map((k) => k / 32);
const found = { velocities: phases.map(sorted), cells: [4800, 9600].map(cells), inertia: inertia() };
process.stdout.write(JSON.stringify(found) + "\n");
