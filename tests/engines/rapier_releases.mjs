// node rapier_releases.mjs FOLDER: what a release of Rapier, as shipped and bare, gives back of a closing speed, as JSON.
// Two discs of radius 0.5 m, restitution 1, no gravity and no friction, 60 steps a second, 32 phases of the step.
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

const phases = [...Array(32).keys()].map((k) => k / 32);
const told = Object.fromEntries([0.2, 1, 5, 20].map((speed) => [speed, phases.map((phase) => givenBack(speed, phase))]));
process.stdout.write(JSON.stringify(told) + "\n");
