// Discs in straight flight, their impacts, and friction: carom/solvers/plain/bodies.py and carom/physics/friction.py.
// A scene is what the JSON of a scene file holds; mass and inertia may be "inf".
import { INF, abs, max, sqrt, twoDiff, twoSum } from "./arithmetic.js";
import { STANDS, countedFrom, isDriven, legsFrom, legsOf, movedOn } from "./driving.js";
import { FiniteWall } from "./finite.js";
import { pairTime, wallTime } from "./meeting.js";

export const frictionImpulse = ([friction, restitution], slip, yielding, pressed) => {
  const held = ((1 + restitution) * slip) / yielding,
    most = friction * pressed;
  return held > most ? most : held < -most ? -most : held;
};
const FARTHEST = 2 ** 49;
const NO_EDGE = [-1, -1];

export const num = (value, other) => (value === undefined ? other : value === "inf" ? INF : value);
export const wallBody = (k) => -1 - k;
export class Bodies {
  constructor(scene) {
    const { discs, walls = [] } = scene,
      get = (f) => discs.map(f);
    this.x = get((d) => d.position_m[0]);
    this.y = get((d) => d.position_m[1]);
    this.vx = get((d) => ((d.legs?.[0] ?? d).velocity_m_s ?? [0, 0])[0]);
    this.vy = get((d) => ((d.legs?.[0] ?? d).velocity_m_s ?? [0, 0])[1]);
    this.radius = get((d) => d.radius_m);
    this.inverseMass = get((d) => 1 / num(d.mass_kg, 1));
    this.ease = get((d) => 1 / num(d.inertia_factor, 0.5));
    this.spin = get((d) => num(d.spin_rad_s, 0));
    this.time = get(() => 0);
    this.lastPartner = get(() => null);
    this.lastHit = get(() => null); // of a finite wall
    this.n = discs.length;
    this.planes = walls.map((w) => (w.normal ? [...w.point_m, ...w.normal] : null)); // of unit length, as Carom stores it
    this.finite = walls.map((w) => (w.normal ? null : new FiniteWall(w)));
    this.paths = { drive: walls.map(legsOf).map((legs) => (isDriven(legs) ? legs : null)) };
    this.paths.driven = get((d) => (d.driven ? legsOf(d) : null));
    this.drive = this.paths.drive; // of walls; legs are counted from the epoch
    this.driven = this.paths.driven; // of discs
    this.drivenFrom = get((d) => d.position_m);
    this.belts = walls.map((w) => w.surface_speed_m_s ?? 0);
    this.gravity = [0, 0];
    this.expected = get(() => walls.map(() => null)); // what of each finite wall a disc meets next
    this.restitution = num(scene.restitution, 1);
    this.wallRestitution = walls.map((w) => w.restitution ?? num(scene.wall_restitution, 1));
    this.grip = [num(scene.friction, 0), num(scene.tangential_restitution, 0)];
    this.wallGrip = walls.map((w) => [
      w.friction ?? num(scene.wall_friction, 0),
      num(scene.wall_tangential_restitution, 0),
    ]);
    this.turns =
      (this.grip[0] > 0 && this.n > 1) || this.wallGrip.some(([f]) => f > 0) || this.spin.some((w) => w !== 0);
    this.epoch = [0, 0];
  }
  sinceStart(t) {
    return this.epoch[0] + (this.epoch[1] + t);
  }
  sinceEpoch(t) {
    return t - this.epoch[0] - this.epoch[1];
  }
  beginEpoch(now) {
    for (let i = 0; i < this.n; i++) {
      if (this.inverseMass[i] > 0) {
        this.forgetEndedLeg(i, now);
        const hit = this.lastHit[i];
        if (this.time[i] < now && hit?.feature?.inside) this.lastHit[i] = { ...hit, feature: null };
        this.moveTo(i, now);
      }
      this.time[i] = 0;
    }
    const [total, rest] = twoSum(this.epoch[0], now);
    this.epoch = [total, this.epoch[1] + rest];
    const since = (paths) => paths.map((legs) => legs && countedFrom(legs, (t) => this.sinceEpoch(t)));
    this.drive = since(this.paths.drive);
    this.driven = since(this.paths.driven);
  }
  // A disc may meet a driven body again that it has met last, where that is on another leg by then.
  forgetEndedLeg(i, t) {
    const partner = this.lastPartner[i];
    if (partner !== null && this.legsAhead(partner, this.time[i])[0].end <= t) this.lastPartner[i] = null;
  }
  moveTo(i, t) {
    if (this.inverseMass[i] === 0) {
      if (this.driven[i]) [this.x[i], this.y[i], this.vx[i], this.vy[i]] = this.drivenAt(i, t);
      return;
    }
    const dt = t - this.time[i];
    this.x[i] += this.vx[i] * dt;
    this.y[i] += this.vy[i] * dt;
    this.time[i] = t;
  }
  // Place and velocity at a time of a disc that no impact moves.
  drivenAt(i, t) {
    return this.driven[i] ? this.drivenOn(i, legsFrom(this.driven[i], t)[0], t) : [this.x[i], this.y[i], 0, 0];
  }
  drivenOn(i, leg, t) {
    const from = this.drivenFrom[i],
      [movedX, movedY] = movedOn(leg, t);
    return [from[0] + movedX, from[1] + movedY, ...leg.velocity];
  }
  // An instant is a pair of floats; without gravity the second is 0.
  stateAt(i, [t]) {
    if (this.driven[i]) return this.drivenAt(i, t);
    const w = t - this.time[i],
      vx = this.vx[i],
      vy = this.vy[i];
    return [this.x[i] + vx * w, this.y[i] + vy * w, vx, vy];
  }
  spinAt(i) {
    return this.spin[i];
  }
  // Place and velocity of a disc, at its own clock, as a wall sees it, which stands where it began.
  seenFrom(i, k) {
    const legs = this.drive[k];
    if (legs === null) return [this.x[i], this.y[i], this.vx[i], this.vy[i]];
    return this.seenOn(i, legsFrom(legs, this.time[i])[0], this.time[i]);
  }
  // The same at a time, as a wall sees it that is on a leg of its path.
  seenOn(i, leg, t) {
    const [x, y, vx, vy] = this.stateAt(i, [t, 0]),
      [movedX, movedY] = movedOn(leg, t),
      [u, v] = leg.velocity;
    return [x - movedX, y - movedY, vx - u, vy - v];
  }
  runs(k) {
    return this.drive[k] !== null || this.belts[k] !== 0;
  }
  velocityOfWall(k, t) {
    return this.drive[k] ? legsFrom(this.drive[k], t)[0].velocity : [0, 0];
  }
  // The legs of a body's path from that at a time on; one that is not driven has one.
  legsAhead(body, t) {
    const legs = body < 0 ? this.drive[-1 - body] : this.driven[body];
    return legs ? legsFrom(legs, t) : STANDS;
  }
  mover(i, k) {
    return this.moverOf(i, this.seenFrom(i, k));
  }
  moverOf(i, [x, y, vx, vy]) {
    return { x: [x, 0], y: [y, 0], ux: twoDiff(vx, 0), uy: twoDiff(vy, 0), radius: this.radius[i] };
  }
  // The feature of a wall that a disc met last; null where its last partner is another.
  lastFeature(i, k) {
    return this.lastPartner[i] === wallBody(k) ? (this.lastHit[i]?.feature ?? null) : null;
  }
  hasJustMet(i, j) {
    return this.inverseMass[i] === 0 || this.lastPartner[i] === j;
  }
  haveJustMet(i, j) {
    return this.hasJustMet(i, j) && this.hasJustMet(j, i);
  }
  nextPairImpact(i, j) {
    const justMet = this.haveJustMet(i, j),
      start = max(this.time[i], this.time[j]);
    for (const [number, leg] of this.legsAhead(this.driven[i] ? i : j, start).entries()) {
      if (justMet && number === 0) continue;
      const begin = max(start, leg.begin),
        [one, other] = [i, j].map((disc) =>
          this.driven[disc] ? this.drivenOn(disc, leg, begin) : this.stateAt(disc, [begin, 0]),
        ),
        met = begin + pairTime(...one, this.radius[i], ...other, this.radius[j]);
      if (met < leg.end) return [met, 0];
    }
    return [INF, 0];
  }
  nextWallImpact(i, k) {
    if (this.inverseMass[i] === 0) return [INF, 0];
    for (const [number, leg] of this.legsAhead(wallBody(k), this.time[i]).entries()) {
      const begin = number ? leg.begin : this.time[i],
        met = begin + this.waitForWall(i, k, leg, begin, number === 0);
      if (met < leg.end) return [met, 0]; // no number above 1e300 s or so
    }
    return [INF, 0];
  }
  // What a disc has met last of a wall counts on the leg on which it did.
  waitForWall(i, k, leg, begin, justLeft) {
    const plane = this.planes[k],
      seen = justLeft ? this.seenFrom(i, k) : this.seenOn(i, leg, begin);
    if (plane) {
      if (justLeft && this.lastPartner[i] === wallBody(k)) return INF;
      return wallTime(...seen, this.radius[i], plane);
    }
    const next = this.finite[k].nextTime(this.moverOf(i, seen), justLeft ? this.lastFeature(i, k) : null);
    if (next.feature) this.expected[i][k] = next;
    return next.time;
  }
  // Whether what was predicted is that a disc comes to glide along a wall.
  glides(i, k) {
    return this.finite[k] !== null && this.expected[i][k].glides;
  }
  pairApproachesAndOverlaps(i, j) {
    if (this.inverseMass[i] === 0 && this.inverseMass[j] === 0) return false;
    const dx = this.x[j] - this.x[i],
      dy = this.y[j] - this.y[i];
    return (
      dx * (this.vx[j] - this.vx[i]) + dy * (this.vy[j] - this.vy[i]) < 0 &&
      sqrt(dx * dx + dy * dy) <= this.radius[i] + this.radius[j]
    );
  }
  wallApproachesAndOverlaps(i, k) {
    if (this.inverseMass[i] === 0 && (this.drive[k] || this.driven[i])) return false;
    const [x, y, vx, vy] = this.seenFrom(i, k);
    if (this.planes[k]) {
      const [px, py, nx, ny] = this.planes[k];
      return vx * nx + vy * ny < 0 && (x - px) * nx + (y - py) * ny <= this.radius[i];
    }
    const { outline } = this.finite[k],
      { at } = outline.nearest(x, y),
      dx = x - at[0],
      dy = y - at[1],
      square = dx * dx + dy * dy,
      reach = outline.halfWidth + this.radius[i];
    return square !== 0 && vx * dx + vy * dy < 0 && square <= reach * reach;
  }
  // Whether two bodies are on the paths that their own impact gave them: what rounding leaves of an approach is none.
  areParting(i, j) {
    if (j >= 0) return this.haveJustMet(i, j);
    const wall = this.finite[-1 - j];
    if (!wall || !this.hasJustMet(i, j)) return this.hasJustMet(i, j);
    const [x, y] = this.seenFrom(i, -1 - j),
      hit = wall.hitFrom(x, y),
      last = this.lastHit[i];
    return hit === null || (last !== null && hit.normal[0] === last.normal[0] && hit.normal[1] === last.normal[1]);
  }
  // Notes what of a wall is nearest to a disc, as PIT finds it.
  find(i, k) {
    if (!this.finite[k]) return;
    const [x, y] = this.seenFrom(i, k);
    this.lastHit[i] = this.finite[k].hitFrom(x, y);
  }
  hit(i, k) {
    if (!this.finite[k]) return null;
    const { feature } = this.expected[i][k];
    return { ...this.finite[k].hit(this.mover(i, k), feature), again: feature === this.lastFeature(i, k) };
  }
  collide(first, second, t) {
    this.moveTo(first, t);
    if (second < 0) {
      this.lastHit[first] = this.hit(first, -1 - second);
      this.lastPartner[first] = second;
      return this.collideWall(first, -1 - second);
    }
    this.lastPartner[first] = second;
    this.moveTo(second, t);
    this.lastPartner[second] = first;
    return this.collidePair(first, second);
  }
  v(i) {
    return [this.vx[i], this.vy[i]];
  }
  // Unit vector from a wall to a disc that it meets, or met last.
  normal(i, k) {
    return this.planes[k] ? this.planes[k].slice(2) : this.lastHit[i].normal;
  }
  collidePair(i, j) {
    const dx = this.x[j] - this.x[i],
      dy = this.y[j] - this.y[i],
      bi = this.v(i),
      bj = this.v(j),
      spins = [this.spin[i], this.spin[j]];
    const far = abs(this.x[i]) + abs(this.y[i]) + abs(this.x[j]) + abs(this.y[j]);
    if (!(far <= FARTHEST * (this.radius[i] + this.radius[j])))
      throw new RangeError("two discs met so far out that floats do not tell their centres apart");
    const time_s = max(this.time[i], this.time[j]),
      wi = this.inverseMass[i],
      wj = this.inverseMass[j];
    const ux = this.vx[j] - this.vx[i],
      uy = this.vy[j] - this.vy[i],
      along = dx * ux + dy * uy;
    const push = along < 0 ? ((1 + this.restitution) * along) / ((dx * dx + dy * dy) * (wi + wj)) : 0;
    this.vx[i] += push * wi * dx;
    this.vy[i] += push * wi * dy;
    this.vx[j] -= push * wj * dx;
    this.vy[j] -= push * wj * dy;
    const distance = sqrt(dx * dx + dy * dy);
    if (this.grip[0] > 0) {
      const surface = distance * (this.radius[i] * this.spin[i] + this.radius[j] * this.spin[j]);
      const yielding = wi * (1 + this.ease[i]) + wj * (1 + this.ease[j]);
      const rub = frictionImpulse(this.grip, dy * ux - dx * uy + surface, (dx * dx + dy * dy) * yielding, -push);
      this.vx[i] += rub * wi * dy;
      this.vy[i] -= rub * wi * dx;
      this.vx[j] -= rub * wj * dy;
      this.vy[j] += rub * wj * dx;
      this.spin[i] -= (rub * distance * wi * this.ease[i]) / this.radius[i];
      this.spin[j] -= (rub * distance * wj * this.ease[j]) / this.radius[j];
    }
    return {
      time_s,
      first: i,
      second: j,
      at: [
        [this.x[i], this.y[i]],
        [this.x[j], this.y[j]],
      ],
      normal: [dx / distance, dy / distance],
      before: [bi, bj],
      after: [this.v(i), this.v(j)],
      spins: this.turns ? [...spins, this.spin[i], this.spin[j]] : null,
      edge: NO_EDGE,
    };
  }
  collideWall(i, k) {
    const [nx, ny] = this.normal(i, k),
      before = this.v(i),
      [u, v] = this.velocityOfWall(k, this.time[i]),
      seen = this.drive[k] ? [before[0] - u, before[1] - v] : before,
      along = seen[0] * nx + seen[1] * ny,
      spin = this.spin[i],
      e = this.wallRestitution[k];
    if (along < 0) {
      this.vx[i] -= (1 + e) * along * nx;
      this.vy[i] -= (1 + e) * along * ny;
    }
    if (this.rubsOn(k) && along < 0) this.rubWall(i, k, seen, -((1 + e) * along));
    return this.wallRecord(i, k, before, spin);
  }
  // Whether an impact on a wall changes more than the speed along its normal.
  rubsOn(k) {
    return this.wallGrip[k][0] > 0;
  }
  // How fast a rim slips on a wall, whose surface may run; of a velocity as seen from the wall.
  slipOn(i, k, [vx, vy]) {
    const [nx, ny] = this.normal(i, k),
      slip = vx * ny - vy * nx + this.radius[i] * this.spin[i];
    return this.belts[k] ? slip + this.belts[k] : slip;
  }
  // `before` is the velocity with which the disc came, as seen from the wall.
  rubWall(i, k, before, pressed) {
    const [nx, ny] = this.normal(i, k),
      rub = frictionImpulse(this.wallGrip[k], this.slipOn(i, k, before), 1 + this.ease[i], pressed);
    this.vx[i] -= rub * ny;
    this.vy[i] += rub * nx;
    this.spin[i] -= (rub * this.ease[i]) / this.radius[i];
  }
  wallRecord(i, k, before, spin) {
    const [nx, ny] = this.normal(i, k),
      drive = this.velocityOfWall(k, this.time[i]);
    return {
      time_s: this.time[i],
      first: i,
      second: wallBody(k),
      at: [[this.x[i], this.y[i]]],
      normal: [-nx, -ny],
      before: [before, drive],
      after: [this.v(i), drive],
      spins: this.turns ? [spin, 0, this.spin[i], 0] : null,
      edge: this.finite[k] ? this.lastHit[i].edge : NO_EDGE,
    };
  }
  // Places, velocities and spins of all discs at an instant.
  allAt(instant) {
    const states = this.x.map((_, i) => this.stateAt(i, instant));
    return {
      positions: states.map((s) => s.slice(0, 2)),
      velocities: states.map((s) => s.slice(2)),
      spins: this.turns ? this.spin.map((_, i) => this.spinAt(i, instant)) : null,
    };
  }
}
