// PIC and PIT without gravity: carom/solvers/plain/run.py and carom/solvers/pit.
import { INF, max, min } from "./arithmetic.js";
import { Bodies, num, wallBody } from "./bodies.js";
import { dampingOf, slowed, slowedAt } from "./damping.js";
import { isAfter, later } from "./instants.js";
import { frac } from "./rational.js";
import { Squeezes } from "./squeeze.js";

// carom.solvers.plain.run: every two bodies are solved for, and the earliest impact is carried out.
const EPOCH_IMPACTS = 32;
const standstillImpacts = (bodies) => min(100 * bodies ** 2, 10_000_000 + Math.floor(bodies ** 2 / 2));

export class AllPairs {
  constructor(scene, bodies = new Bodies(scene), epochImpacts = EPOCH_IMPACTS) {
    const walls = bodies.planes.length;
    Object.assign(this, { bodies, walls, epochImpacts, end: scene.duration_s, outcome: null, impacts: [] });
    this.now = [0, 0]; // of the last impact, since the epoch
    this.reported = 0; // since the start
    this.atInstant = 0;
    this.standstill = standstillImpacts(bodies.n + walls);
    this.squeezes = [...bodies.drive, ...bodies.driven].some(Boolean) ? new Squeezes(bodies, this.standstill) : null;
    // Row i holds when disc i meets the last wall, ..., the first, disc 0, ..., the last, each pair once.
    this.width = walls + bodies.n;
    this.heads = new Float64Array(bodies.n * this.width).fill(INF);
    this.rests = new Float64Array(bodies.n * this.width);
  }
  begin() {
    for (let i = 0; i < this.bodies.n; i++) this.predict(i, (other) => other > i);
  }
  predict(disc, asked) {
    for (let k = 0; k < this.walls; k++) this.expect(disc, wallBody(k));
    for (let o = 0; o < this.bodies.n; o++)
      if (o !== disc && asked(o)) this.expect(min(disc, o), max(disc, o));
  }
  expect(first, second) {
    const b = this.bodies;
    this.keep(first, second, second < 0 ? b.nextWallImpact(first, -1 - second) : b.nextPairImpact(first, second));
  }
  keep(first, second, [head, rest]) {
    const at = first * this.width + this.walls + second;
    this.heads[at] = head;
    this.rests[at] = rest;
  }
  next() {
    const { heads, rests } = this;
    let at = 0;
    for (let k = 1; k < heads.length; k++)
      if (heads[k] < heads[at] || (heads[k] === heads[at] && rests[k] < rests[at])) at = k;
    return [[heads[at], rests[at]], Math.floor(at / this.width), (at % this.width) - this.walls];
  }
  sinceStart(t) {
    return max(this.reported, this.bodies.sinceStart(t));
  }
  run(maxImpacts) {
    this.begin();
    while (this.outcome === null) {
      const [instant, first, second] = this.next();
      if (this.atInstant > this.standstill) this.outcome = "standstill";
      else if (instant[0] === INF || isAfter([this.sinceStart(instant[0]), instant[1]], [this.end, 0]))
        this.outcome = "completed";
      else if (this.impacts.length >= maxImpacts) this.outcome = "max_impacts";
      else this.carryOut(first, second, instant);
    }
    return this.ended(this.outcome === "completed" ? this.end : this.reported);
  }
  ended(until) {
    const { impacts, outcome, bodies } = this;
    return { impacts, outcome, end_s: until, modes: null, ...bodies.allAt([bodies.sinceEpoch(until), 0]) };
  }
  carryOut(first, second, instant) {
    const b = this.bodies;
    if (instant[0] > this.now[0]) this.atInstant = 0;
    this.now = later(this.now, instant);
    this.reported = this.sinceStart(this.now[0]);
    let moved = (second >= 0 ? [first, second] : [first]).filter((d) => b.inverseMass[d] > 0);
    const record = this.collide(first, second, moved);
    if (record === null) return;
    this.atInstant++;
    this.impacts.push({ ...record, time_s: this.reported });
    this.recorded();
    if (this.squeezes)
      for (const disc of moved) {
        const back = record.normal.map((value) => -value),
          told = disc === first ? [second, back] : [first, record.normal];
        if (b.sinceStart(this.squeezes.struck(disc, ...told)) <= this.end) this.outcome = "crushed";
      }
    if (this.outcome !== null) return;
    if (this.impacts.length % (this.epochImpacts * b.n) === 0) {
      b.beginEpoch(this.now[0]);
      this.now = [0, 0];
      moved = Array.from({ length: b.n }, (_, k) => k);
    }
    moved.forEach((disc, done) => this.predict(disc, (other) => !moved.slice(0, done + 1).includes(other)));
  }
  recorded() {}
  collide(first, second) {
    if (second < 0 && this.bodies.glides(first, -1 - second)) {
      this.outcome = "glides";
      return null;
    }
    return this.bodies.collide(first, second, this.now[0]);
  }
}
export function solvePic(scene, maxImpacts = INF) {
  const damping = dampingOf(scene);
  if (!damping) return new AllPairs(scene).run(maxImpacts);
  const { duration_s } = scene,
    run = new AllPairs({ ...scene, duration_s: damping.latest(duration_s) }).run(maxImpacts),
    end_s = run.outcome === "completed" ? duration_s : damping.damped(run.end_s);
  const impacts = run.impacts.map((impact) => slowed(impact, damping, damping.damped(impact.time_s)));
  return { ...run, impacts, end_s, ...slowedAt(end_s, damping, run) };
}

// Checks for overlap once per frame: frame k at (k + phase) / rate. Carom's PIT has phase 0.
export function framesBefore(duration, dt) {
  // carom.scene.steps_to_cover, in whole numbers
  const [a, e] = frac(duration),
    [c, f] = frac(dt),
    whole = a << BigInt(f),
    part = c << BigInt(e),
    nearest = (2n * whole + part) / (2n * part);
  let off = whole - nearest * part;
  if (off < 0n) off = -off;
  return Number(nearest > 0n && off * (1n << 52n) <= whole ? nearest : (whole + part - 1n) / part);
}
export function solvePit(scene, rate = num(scene.frame_rate_hz, 60), { phase = 0, bodies = new Bodies(scene) } = {}) {
  const b = bodies,
    n = b.n,
    impacts = [],
    damping = dampingOf(scene),
    movedBy = (t) => (damping ? damping.undamped(t) : t),
    frames = phase ? Math.ceil(scene.duration_s * rate - phase) : framesBefore(scene.duration_s, 1 / rate);
  for (let frame = 0; frame < frames; frame++) {
    const clock = phase ? (frame + phase) / rate : frame / rate,
      t = movedBy(clock),
      add = (impact) => impacts.push(damping ? slowed(impact, damping, clock) : impact);
    if (frame > 0 || phase)
      for (let i = 0; i < n; i++) {
        b.forgetEndedLeg(i, t);
        b.moveTo(i, t);
      }
    for (let i = 0; i < n; i++)
      for (let j = i + 1; j < n; j++)
        if (b.pairApproachesAndOverlaps(i, j) && !b.areParting(i, j)) {
          add(b.collidePair(i, j));
          b.lastPartner[i] = j;
          b.lastPartner[j] = i;
        }
    for (let i = 0; i < n; i++)
      for (let k = 0; k < b.planes.length; k++)
        if (b.wallApproachesAndOverlaps(i, k) && !b.areParting(i, wallBody(k))) {
          b.find(i, k);
          add(b.collideWall(i, k));
          b.lastPartner[i] = wallBody(k);
        }
  }
  const end_s = scene.duration_s,
    end = b.allAt([movedBy(end_s), 0]);
  return { impacts, outcome: "completed", end_s, frames, modes: null, ...(damping ? slowedAt(end_s, damping, end) : end) };
}
