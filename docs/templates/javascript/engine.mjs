// An engine behind Carom's protocol: a toy in World, the protocol below it. Put your engine in place of World.
import { createInterface } from "node:readline";

class World {
  constructor(scene, settings) {
    this.settings = settings;
    this.dt = settings.dt_s;
    this.discs = scene.discs.map((disc) => ({
      x: [...disc.position_m],
      v: [...disc.velocity_m_s],
      radius: disc.radius_m,
      inverseMass: disc.mass_kg === "inf" ? 0 : 1 / disc.mass_kg, // JSON has no infinity
    }));
    this.scene = scene;
    this.time = 0; // a clock that is summed up, or, where steps are never cut, steps times dt
    this.contacts = [];
  }

  // Every pair of bodies that overlap: [first, second, unit normal from first to second]; wall k is body -1 - k.
  overlapping() {
    const found = [];
    for (const [i, a] of this.discs.entries()) {
      for (const [k, wall] of this.scene.walls.entries()) {
        const [nx, ny] = wall.normal;
        const gap = (a.x[0] - wall.point_m[0]) * nx + (a.x[1] - wall.point_m[1]) * ny - a.radius;
        if (gap < 0) found.push([i, -1 - k, [-nx, -ny]]);
      }
      for (let j = i + 1; j < this.discs.length; j++) {
        const b = this.discs[j];
        const [dx, dy] = [b.x[0] - a.x[0], b.x[1] - a.x[1]];
        const distance = Math.hypot(dx, dy);
        if (distance < a.radius + b.radius) found.push([i, j, [dx / distance, dy / distance]]);
      }
    }
    return found;
  }

  step() {
    const start = this.time;
    const [gx, gy] = this.scene.gravity_m_s2;
    this.contacts = [];
    for (const [first, second, [nx, ny]] of this.overlapping()) {
      const a = this.discs[first];
      const b = second < 0 ? { v: [0, 0], inverseMass: 0 } : this.discs[second];
      const closing = (a.v[0] - b.v[0]) * nx + (a.v[1] - b.v[1]) * ny;
      const inverse = a.inverseMass + b.inverseMass;
      if (closing <= 0 || inverse === 0) continue;
      const restitution = second < 0 ? this.scene.wall_restitution : this.scene.restitution;
      const impulse = ((1 + restitution) * closing) / inverse;
      for (const [body, sign] of [[a, -1], [b, 1]]) {
        body.v[0] += sign * impulse * body.inverseMass * nx;
        body.v[1] += sign * impulse * body.inverseMass * ny;
      }
      this.contacts.push({ first, second, time_s: start, normal: [nx, ny], impulse_n_s: impulse });
    }
    for (const disc of this.discs) {
      if (disc.inverseMass === 0) continue;
      disc.x[0] += (disc.v[0] + (gx * this.dt) / 2) * this.dt;
      disc.x[1] += (disc.v[1] + (gy * this.dt) / 2) * this.dt;
      disc.v[0] += gx * this.dt;
      disc.v[1] += gy * this.dt;
    }
    this.time += this.dt;
  }

  state() {
    return { time: this.time, discs: this.discs.map(({ x, v }) => ({ x: [...x], v: [...v] })) };
  }
}

const worlds = new Map();
let worldsMade = 0;

const answers = {
  hello: () => ({ protocol: 1, version: "1.0" }),
  prepare({ scene, settings }) {
    worlds.set(++worldsMade, new World(scene, settings));
    return { world: worldsMade, settings };
  },
  step({ world, steps }) {
    const began = process.hrtime.bigint(); // the program's own clock: pipes are no part of it
    for (let step = 0; step < steps; step++) world.step();
    return { seconds: Number(process.hrtime.bigint() - began) / 1e9 };
  },
  observe: ({ world }) => ({
    position_m: world.discs.map(({ x }) => x),
    velocity_m_s: world.discs.map(({ v }) => v),
    contacts: world.contacts,
  }),
  close: ({ world }, number) => (worlds.delete(number), {}),
  // These four are for profiles that are `located`; without them, leave these profiles out.
  cut: ({ world, dt_s }) => ((world.dt = dt_s), {}),
  touching: ({ world }) => ({ pairs: world.overlapping().map(([first, second]) => [first, second]) }),
  save: ({ world }) => ({ state: world.state() }),
  restore({ world, state }) {
    world.time = state.time;
    for (const [i, disc] of world.discs.entries()) [disc.x, disc.v] = [[...state.discs[i].x], [...state.discs[i].v]];
    return {};
  },
};

for await (const line of createInterface({ input: process.stdin })) {
  let answer;
  try {
    const request = JSON.parse(line);
    if (!(request.do in answers)) throw new Error(`there is no request ${request.do}`);
    const number = request.world;
    if (number !== undefined) request.world = worlds.get(number);
    answer = answers[request.do](request, number);
  } catch (error) {
    answer = { error: { kind: "failed", message: String(error) } }; // "refused", where it is what was asked for
  }
  process.stdout.write(JSON.stringify(answer) + "\n");
}
