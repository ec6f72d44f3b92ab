// node rapier_releases.mjs FOLDER [rows]: what a release of Rapier, as shipped and bare, gives back of a closing speed, as JSON.
// Two discs of radius 0.5 m, restitution 1, no gravity and no friction, 60 steps per second, 32 phases of the step.
// With `rows`, of five equal discs in a line, as shipped and with the settings of Carom's profile `tuned`: how far the
// velocities at the end are from the exchanged ones, over the fastest, how often a contact with an impulse is told of, and
// how many steps before two meet they turn, at most.
import { createRequire } from "node:module";
import { pathToFileURL } from "node:url";

const NAME = "@dimforge/rapier2d-compat";
const require = createRequire(`${process.argv[2]}/x.cjs`);
const main = require.resolve(NAME);
const beside = pathToFileURL(main.replace("cjs.js", "es.js").replace("rapier.cjs", "rapier.mjs"));
const loaded = await import(beside).catch(() => require(NAME));
const RAPIER = loaded.default ?? loaded;
console.warn = () => {};
await RAPIER.init();

function givenBack(speed, phase) {
  const world = new RAPIER.World({ x: 0, y: 0 });
  world.timestep = 1 / 60;
  const disc = (x, velocity) => {
    const desc = RAPIER.RigidBodyDesc.dynamic().setTranslation(x, 0).setLinvel(velocity, 0).setCanSleep(false);
    const body = world.createRigidBody(desc);
    world.createCollider(RAPIER.ColliderDesc.ball(0.5).setRestitution(1).setFriction(0), body);
    return body;
  };
  const moving = disc(-0.5 - speed * (0.25 + phase / 60), speed);
  const resting = disc(0.5, 0);
  for (let step = 0; step < 45; step++) world.step();
  const found = (resting.linvel().x - moving.linvel().x) / speed;
  world.free();
  return found;
}

const TUNED = { lengthUnit: 1024, normalizedPredictionDistance: 0, contact_natural_frequency: 0 };

function row(settings, phase) {
  const world = new RAPIER.World({ x: 0, y: 0 });
  world.timestep = 1 / 60;
  Object.assign(world.integrationParameters, settings);
  const velocities = [2.5, 1.6, 0.5, -0.8, -1.9];
  const bodies = [0, 0.65, 1.9, 2.45, 3.9].map((x, k) => {
    const desc = RAPIER.RigidBodyDesc.dynamic().setAdditionalMass(1).lockRotations().setCanSleep(false);
    const body = world.createRigidBody(desc.setTranslation(x - (phase * velocities[k]) / 60, 0).setLinvel(velocities[k], 0));
    world.createCollider(RAPIER.ColliderDesc.ball(0.1).setDensity(0).setRestitution(1).setFriction(0), body);
    return body;
  });
  let told = 0;
  let early = -Infinity;
  const states = () => bodies.map((body) => [body.translation().x, body.linvel().x]);
  for (let step = 0; step < 106; step++) {
    const before = states();
    world.step();
    const after = states();
    for (let k = 0; k < 4; k++) {
      const [[[x, v], [y, w]], closing] = [before.slice(k), after[k][1] - after[k + 1][1]];
      if (v > w && closing < 0) early = Math.max(early, ((y - x - 0.2) * 60) / (v - w));
    }
    const pushes = (manifold) => [...Array(manifold.numContacts()).keys()].some((k) => manifold.contactImpulse(k) > 0);
    for (let k = 0; k < 4; k++)
      world.contactPair(bodies[k].collider(0), bodies[k + 1].collider(0), (manifold) => (told += pushes(manifold)));
  }
  const found = bodies.map((body) => body.linvel().x);
  world.free();
  const wanted = [...velocities].sort((a, b) => a - b);
  return [Math.max(...found.map((velocity, k) => Math.abs(velocity - wanted[k]))) / 2.5, told, early];
}

const phases = [...Array(32).keys()].map((k) => k / 32);
const rows = (settings) => phases.map((phase) => row(settings, phase));
const slow = () => Object.fromEntries([0.2, 1, 5, 20].map((speed) => [speed, phases.map((phase) => givenBack(speed, phase))]));
const told = process.argv[3] === "rows" ? { shipped: rows({}), tuned: rows(TUNED) } : slow();
process.stdout.write(JSON.stringify(told) + "\n");
