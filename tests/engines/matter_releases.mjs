// node matter_releases.mjs FOLDER: what bodies are in a release of matter.js, as JSON: a static body's cells in the grid, by
// its side; the inertia of a disc over mass times radius squared, as made and after `Body.setMass`.
import { createRequire } from "node:module";

const { Bodies, Body, Composite, Engine } = createRequire(`${process.argv[2]}/x.cjs`)("matter-js");
const STEP = 1000 / 60; // ms

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

process.stdout.write(JSON.stringify({ cells: [4800, 9600].map(cells), inertia: inertia() }) + "\n");
