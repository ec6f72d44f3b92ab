// PIC and PIT under gravity: carom/solvers/falling and carom/solvers/plain/instants.py.
import { INF, abs, max, sqrt, twoDiff, twoProd, twoSum } from "./arithmetic.js";
import { Bodies, wallBody } from "./bodies.js";
import { descentTime, encounterTime, returnTime } from "./encounter.js";
import { solvePit, standstillImpacts } from "./flying.js";
import { excess, pairTime, wallGap, wallSpeed } from "./meeting.js";

const NEVER = [INF, 0];

// math.hypot of Python is right to the nearest float or very nearly; that of JavaScript need not be: this one is.
const hypot = (x, y) => {
  if (x === 0 || y === 0) return abs(x) + abs(y);
  const [a, ar] = twoProd(x, x),
    [b, br] = twoProd(y, y),
    [s, sr] = twoSum(a, b),
    low = sr + (ar + br),
    h = sqrt(s + low);
  const [q, qr] = twoProd(h, h);
  return h + (s - q - qr + low) / (2 * h);
};

const after = (instant, wait) => {
  if (wait === INF) return NEVER;
  const [t, r] = twoSum(instant[0], wait);
  return twoSum(t, instant[1] + r);
};
const between = (a, b) => b[0] - a[0] + (b[1] - a[1]);
const later = (a, b) => (a[0] > b[0] || (a[0] === b[0] && a[1] >= b[1]) ? a : b);
const order = (a, b) => a[0] - b[0] || a[1] - b[1];

export class FallingBodies extends Bodies {
  constructor(scene) {
    super(scene);
    this.gravity = scene.gravity_m_s2;
    this.pull = this.walls.map(([, , nx, ny]) => wallSpeed(...this.gravity, nx, ny));
    this.instant = this.x.map(() => [0, 0]);
    this.leaving = this.x.map(() => 0);
  }
  stateAt(i, instant) {
    const own = this.instant[i];
    if (this.inverseMass[i] === 0) return [this.x[i], this.y[i], 0, 0];
    if (own[0] === instant[0] && own[1] === instant[1]) return [this.x[i], this.y[i], this.vx[i], this.vy[i]];
    const dt = between(own, instant),
      [gx, gy] = this.gravity;
    return [
      this.x[i] + dt * (this.vx[i] + 0.5 * gx * dt),
      this.y[i] + dt * (this.vy[i] + 0.5 * gy * dt),
      this.vx[i] + gx * dt,
      this.vy[i] + gy * dt,
    ];
  }
  bringTo(i, instant) {
    if (this.inverseMass[i] > 0) {
      [this.x[i], this.y[i], this.vx[i], this.vy[i]] = this.stateAt(i, instant);
      this.instant[i] = instant;
      this.time[i] = instant[0];
    }
  }
  moveTo(i, t) {
    this.bringTo(i, [t, 0]);
  }
  path(i, t) {
    return [...this.stateAt(i, [t, 0]), this.radius[i]];
  }
  nextPairImpact(i, j) {
    if (this.inverseMass[i] === 0 || this.inverseMass[j] === 0)
      return this.inverseMass[i] === 0 ? this.nextOnFixed(j, i) : this.nextOnFixed(i, j);
    if (this.hasJustMet(i, j) && this.hasJustMet(j, i)) return NEVER;
    const start = later(this.instant[i], this.instant[j]);
    return after(start, pairTime(...this.stateAt(i, start), this.radius[i], ...this.stateAt(j, start), this.radius[j]));
  }
  // Two movable discs fall alike; a fall onto what does not fall comes back.
  areParting(i, j) {
    return j >= 0 && this.inverseMass[i] > 0 && this.inverseMass[j] > 0 && super.areParting(i, j);
  }
  earliestOnFixed(i, j) {
    if ((this.inverseMass[i] === 0) === (this.inverseMass[j] === 0)) return null;
    let fixed = j;
    if (this.inverseMass[i] === 0) [i, fixed] = [j, i];
    if (this.lastPartner[i] === fixed) return this.instant[i];
    const reach = this.radius[i] + this.radius[fixed];
    let gap = hypot(this.x[i] - this.x[fixed], this.y[i] - this.y[fixed]) - reach;
    gap -= this.resolution(i, this.x[fixed], this.y[fixed], this.radius[fixed]);
    if (!(gap > 0)) return this.instant[i];
    const speed = hypot(this.vx[i], this.vy[i]),
      pull = hypot(...this.gravity);
    return after(this.instant[i], 0.99 * ((2 * gap) / (speed + sqrt(speed * speed + 2 * pull * gap))));
  }
  nextOnFixed(i, fixed) {
    if (this.inverseMass[i] === 0) return NEVER;
    const disc = [...this.stateAt(i, this.instant[i]), this.radius[i]];
    return after(
      this.instant[i],
      encounterTime(
        disc,
        [this.x[fixed], this.y[fixed], this.radius[fixed]],
        this.gravity,
        this.lastPartner[i] === fixed ? this.leaving[i] : null,
      ),
    );
  }
  nextWallImpact(i, k) {
    if (this.inverseMass[i] === 0) return NEVER;
    if (this.lastPartner[i] === wallBody(k))
      return after(this.instant[i], this.pull[k][0] < 0 ? returnTime([this.leaving[i], 0], this.pull[k]) : INF);
    const gap = wallGap(this.x[i], this.y[i], this.radius[i], this.walls[k]);
    return after(
      this.instant[i],
      descentTime(gap, wallSpeed(this.vx[i], this.vy[i], this.walls[k][2], this.walls[k][3]), this.pull[k]),
    );
  }
  // How well a gap is known: `gap_resolution` of carom/solvers/impact/resolution.py, of the sizes of both bodies.
  resolution(i, x, y, radius) {
    return 5 * 2 ** -52 * (abs(this.x[i]) + abs(this.y[i]) + this.radius[i] + (abs(x) + abs(y) + radius));
  }
  contactWithWall(i, k) {
    const [qx, qy, nx, ny] = this.walls[k],
      again = this.lastPartner[i] === wallBody(k);
    return [
      again ? this.leaving[i] : -wallSpeed(this.vx[i], this.vy[i], nx, ny)[0],
      this.pull[k][0],
      this.resolution(i, qx, qy, 0),
    ];
  }
  contactWithFixed(i, f) {
    const dx = this.x[i] - this.x[f],
      dy = this.y[i] - this.y[f],
      d = hypot(dx, dy);
    const opening = (dx * this.vx[i] + dy * this.vy[i]) / d,
      across = (dx * this.vy[i] - dy * this.vx[i]) / d;
    const pull = (dx * this.gravity[0] + dy * this.gravity[1]) / d + (across * across) / d;
    return [-opening, pull, this.resolution(i, this.x[f], this.y[f], this.radius[f])];
  }
  leaveFixed(i, f, record) {
    const dx = this.x[i] - this.x[f],
      dy = this.y[i] - this.y[f],
      d = hypot(dx, dy),
      reach = twoSum(this.radius[i], this.radius[f]);
    const beyond = excess(twoDiff(this.x[i], this.x[f]), twoDiff(this.y[i], this.y[f]), reach)[0],
      part = beyond / ((d + reach[0]) * d);
    this.x[i] -= part * dx;
    this.y[i] -= part * dy;
    const before = record.before[record.first === i ? 0 : 1];
    this.leaving[i] = this.restitution * max(0, -(dx * before[0] + dy * before[1]) / d);
  }
  bounce(i, k, approach) {
    const [, , nx, ny] = this.walls[k],
      before = this.v(i),
      spin = this.spin[i],
      gap = wallGap(this.x[i], this.y[i], this.radius[i], this.walls[k])[0];
    this.x[i] -= gap * nx;
    this.y[i] -= gap * ny;
    if (approach > 0) {
      this.leaveWall(i, k, this.wallRestitution * approach);
      if (this.wallGrip[0] > 0) this.rubWall(i, k, before, (1 + this.wallRestitution) * approach);
    }
    this.lastPartner[i] = wallBody(k);
    return this.wallRecord(i, k, before, spin);
  }
  leaveWall(i, k, speed) {
    const [, , nx, ny] = this.walls[k],
      change = speed - wallSpeed(this.vx[i], this.vy[i], nx, ny)[0];
    this.vx[i] += change * nx;
    this.vy[i] += change * ny;
    this.leaving[i] = speed;
  }
}

export function solvePicFalling(scene, maxImpacts = INF) {
  const b = new FallingBodies(scene),
    n = b.n,
    end = [scene.duration_s, 0],
    impacts = [],
    version = b.x.map(() => 0);
  let events = [],
    now = [0, 0],
    outcome = null,
    note = "";
  const expect = (instant, i, j, certain = true) => {
    if (instant[0] < INF) events.push([instant, i, j, version[i], j >= 0 ? version[j] : 0, certain]);
  };
  const predict = (i, skip) => {
    for (let o = 0; o < n; o++)
      if (!skip.includes(o) && o !== i) {
        const [a, c] = i < o ? [i, o] : [o, i],
          earliest = b.earliestOnFixed(a, c);
        if (earliest === null) expect(b.nextPairImpact(a, c), a, c);
        else expect(earliest, a, c, false);
      }
    for (let k = 0; k < b.walls.length; k++) expect(b.nextWallImpact(i, k), i, wallBody(k));
  };
  const rests = ([approach, pull, gap], last, what) => {
    const is =
      !(pull < 0) || !(approach > 0) ? pull < 0 : last ? last[0] === now[0] : approach * approach <= -2 * pull * gap;
    if (is) {
      outcome = "at_rest";
      note = what;
    }
    return is;
  };
  const carriedOut = (record, changed) => {
    impacts.push({ ...record, time_s: now[0] });
    const movable = changed.filter((d) => b.inverseMass[d] > 0);
    for (const d of movable) version[d]++;
    movable.forEach((d, done) => predict(d, movable.slice(0, done)));
  };
  const earlier = (p, q) => {
    const o = order(p[0], q[0]);
    if (o) return o < 0;
    for (let k = 1; k < 6; k++) if (p[k] !== q[k]) return p[k] < q[k];
    return false;
  };
  for (let i = 0; i < n; i++)
    predict(
      i,
      Array.from({ length: i + 1 }, (_, k) => k),
    );
  while (!outcome && events.length) {
    events = events.filter(([, i, j, vi, vj]) => version[i] === vi && (j < 0 || version[j] === vj)); // in place of a heap
    let least = 0;
    for (let k = 1; k < events.length; k++) if (earlier(events[k], events[least])) least = k;
    if (!events.length) break;
    const [instant, i, j, , , certain] = events[least];
    if (order(instant, end) > 0) break;
    if (certain && impacts.length >= maxImpacts) {
      outcome = "max_impacts";
      break;
    }
    events.splice(least, 1);
    if (!certain) {
      expect(b.nextPairImpact(i, j), i, j);
      continue;
    }
    now = later(now, instant);
    if (j < 0) {
      const k = -1 - j,
        last = b.lastPartner[i] === j ? b.instant[i] : null;
      b.bringTo(i, now);
      const contact = b.contactWithWall(i, k);
      if (rests(contact, last, `disc ${i} on wall ${k}`)) b.leaveWall(i, k, 0);
      else carriedOut(b.bounce(i, k, contact[0]), [i]);
      continue;
    }
    let resting = false;
    for (const [one, other] of [
      [i, j],
      [j, i],
    ]) {
      b.bringTo(one, now);
      if (b.inverseMass[other] === 0 && rests(b.contactWithFixed(one, other), null, `disc ${one} on disc ${other}`)) {
        resting = true;
        break;
      }
    }
    if (resting) continue;
    b.lastPartner[i] = j;
    b.lastPartner[j] = i;
    const record = b.collidePair(i, j);
    for (const [one, other] of [
      [i, j],
      [j, i],
    ])
      if (b.inverseMass[other] === 0) b.leaveFixed(one, other, record);
    carriedOut(record, [i, j]);
  }
  const until = outcome ? now : later(now, end),
    states = b.x.map((_, i) => b.stateAt(i, until));
  return {
    impacts,
    outcome: outcome ?? "completed",
    note,
    end_s: until[0],
    positions: states.map((s) => s.slice(0, 2)),
    velocities: states.map((s) => s.slice(2)),
    spins: b.turns ? [...b.spin] : null,
  };
}
export function solvePitFalling(scene, rate, options = {}) {
  const bodies = new FallingBodies(scene),
    found = solvePit(scene, rate ?? scene.frame_rate_hz, { ...options, bodies });
  const states = bodies.x.map((_, i) => bodies.stateAt(i, [scene.duration_s, 0]));
  return { ...found, positions: states.map((s) => s.slice(0, 2)), velocities: states.map((s) => s.slice(2)) };
}
