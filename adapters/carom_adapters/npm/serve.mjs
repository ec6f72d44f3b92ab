// What the engines share: Carom's protocol (docs/engine-protocol.md) around a class of worlds, and what these need of a scene.
import { createInterface } from "node:readline";

// Reads requests and answers them. A world has step(), observe() and the settings that it really uses; for located
// profiles cut(dt), touching(), save() and restore(state), too; and free(), where its engine's memory is not JavaScript's.
export async function serve(World) {
  const worlds = new Map();
  let made = 0;
  const answers = {
    hello: () => ({ protocol: 1 }),
    prepare({ scene, settings }) {
      const world = new World(scene, settings);
      worlds.set(++made, world);
      return { world: made, settings: world.settings };
    },
    step({ steps }, world) {
      const began = process.hrtime.bigint();
      for (let step = 0; step < steps; step++) world.step();
      return { seconds: Number(process.hrtime.bigint() - began) / 1e9 };
    },
    observe: (_, world) => world.observe(),
    cut: ({ dt_s }, world) => (world.cut(dt_s), {}),
    touching: (_, world) => ({ pairs: world.touching() }),
    save: (_, world) => ({ state: world.save() }),
    restore: ({ state }, world) => (world.restore(state), {}),
    close: (request, world) => (world.free?.(), worlds.delete(request.world), {}),
  };
  for await (const line of createInterface({ input: process.stdin })) {
    let answer;
    try {
      const request = JSON.parse(line);
      if (!(request.do in answers)) throw new Error(`there is no request ${request.do}`);
      answer = answers[request.do](request, worlds.get(request.world));
    } catch (error) {
      const kind = error instanceof Refusal ? "refused" : "failed";
      answer = { error: { kind, message: error.message ?? String(error) } };
    }
    process.stdout.write(JSON.stringify(answer) + "\n");
  }
}

// What a world throws where the scene or a setting is beyond its engine.
export class Refusal extends Error {}

// The time of a world that counts its steps: of equal length, until they are cut or a state is restored.
export class Clock {
  constructor(dt) {
    this.dt = dt;
    this.restart(0);
  }
  get now() {
    return this.start + this.steps * this.dt;
  }
  get stepBegan() {
    return this.start + (this.steps - 1) * this.dt;
  }
  cut(dt) {
    this.restart(this.now);
    this.dt = dt;
  }
  restart(time) {
    this.start = time;
    this.steps = 0;
  }
}

// The number that the protocol gives wall k.
export const wallBody = (k) => -1 - k;

// A disc that nothing moves: JSON has no infinity.
export const isImmovable = (disc) => disc.mass_kg === "inf";

// Two bodies in the protocol's order: the disc of the lower number first, a wall second.
export function pairOf(a, b) {
  const [low, high] = a < b ? [a, b] : [b, a];
  return low < 0 ? [high, low] : [low, high];
}

// The contact of two bodies in either order; the normal is from a to b, a unit vector to the engine's rounding.
export function contactOf(a, b, time_s, nx, ny, impulse_n_s) {
  const [first, second] = pairOf(a, b);
  const length = Math.hypot(nx, ny) * (first === a ? 1 : -1);
  return { first, second, time_s, normal: [nx / length, ny / length], impulse_n_s };
}

// The middle of a scene, and how far from it any point of a disc can be at any time of it: what walls of an engine
// without half-planes must span. No impact adds energy, so no disc is ever faster than if it alone had all of it, or
// than gravity makes it besides, for itself and, through impacts, for heavier ones.
export function reach(scene, dt) {
  const [xs, ys] = [0, 1].map((axis) => scene.discs.map((disc) => disc.position_m[axis]));
  const centre = [xs, ys].map((values) => Math.min(...values) / 2 + Math.max(...values) / 2);
  const start = Math.max(
    ...scene.discs.map(({ position_m: [x, y], radius_m }) => Math.hypot(x - centre[0], y - centre[1]) + radius_m),
  );
  const movable = scene.discs.filter((disc) => !isImmovable(disc));
  const lightest = Math.min(...movable.map((disc) => disc.mass_kg));
  const shares = movable.map((disc) => disc.mass_kg / lightest);
  const fastest = Math.hypot(...movable.map((disc, i) => Math.sqrt(shares[i]) * Math.hypot(...disc.velocity_m_s)));
  const duration = scene.duration_s + dt;
  const total = shares.reduce((sum, share) => sum + share, 0);
  const gained = Math.hypot(...scene.gravity_m_s2) * duration * Math.sqrt(total);
  return { centre, radius: start + (fastest + gained) * duration };
}

// The point of a wall nearest to the middle of a scene, and half the side of a square behind it that spans the scene.
export function wallAt(wall, { centre, radius }) {
  const [[px, py], [nx, ny]] = [wall.point_m, wall.normal];
  const along = (px - centre[0]) * ny - (py - centre[1]) * nx;
  const gap = Math.abs((px - centre[0]) * nx + (py - centre[1]) * ny);
  return { point: [px - along * ny, py + along * nx], size: radius + gap };
}
