// Discs in straight flight, their impacts, and friction: carom/solvers/plain/bodies.py and carom/physics/friction.py.
// A scene is what the JSON of a scene file holds; mass and inertia may be "inf".
import { INF, max, sqrt, twoSum } from "./arithmetic.js";
import { pairTime, wallTime } from "./meeting.js";

const frictionImpulse = ([friction, restitution], slip, yielding, pressed) => {
  const held = ((1 + restitution) * slip) / yielding,
    most = friction * pressed;
  return held > most ? most : held < -most ? -most : held;
};

export const num = (value, other) => (value === undefined ? other : value === "inf" ? INF : value);
export const wallBody = (k) => -1 - k;
export class Bodies {
  constructor(scene) {
    const { discs, walls = [] } = scene,
      get = (f) => discs.map(f);
    this.x = get((d) => d.position_m[0]);
    this.y = get((d) => d.position_m[1]);
    this.vx = get((d) => (d.velocity_m_s ?? [0, 0])[0]);
    this.vy = get((d) => (d.velocity_m_s ?? [0, 0])[1]);
    this.radius = get((d) => d.radius_m);
    this.inverseMass = get((d) => 1 / num(d.mass_kg, 1));
    this.ease = get((d) => 1 / num(d.inertia_factor, 0.5));
    this.spin = get((d) => num(d.spin_rad_s, 0));
    this.time = get(() => 0);
    this.lastPartner = get(() => null);
    this.n = discs.length;
    this.walls = walls.map((w) => [...w.point_m, ...w.normal]); // of unit length, as Carom stores it
    this.restitution = num(scene.restitution, 1);
    this.wallRestitution = num(scene.wall_restitution, 1);
    this.grip = [num(scene.friction, 0), num(scene.tangential_restitution, 0)];
    this.wallGrip = [num(scene.wall_friction, 0), num(scene.wall_tangential_restitution, 0)];
    this.turns =
      (this.grip[0] > 0 && this.n > 1) || (this.wallGrip[0] > 0 && walls.length > 0) || this.spin.some((w) => w !== 0);
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
      if (this.inverseMass[i] > 0) this.moveTo(i, now);
      this.time[i] = 0;
    }
    const [total, rest] = twoSum(this.epoch[0], now);
    this.epoch = [total, this.epoch[1] + rest];
  }
  moveTo(i, t) {
    if (this.inverseMass[i] === 0) return;
    const dt = t - this.time[i];
    this.x[i] += this.vx[i] * dt;
    this.y[i] += this.vy[i] * dt;
    this.time[i] = t;
  }
  path(i, t) {
    const w = t - this.time[i];
    return [this.x[i] + this.vx[i] * w, this.y[i] + this.vy[i] * w, this.vx[i], this.vy[i], this.radius[i]];
  }
  hasJustMet(i, j) {
    return this.inverseMass[i] === 0 || this.lastPartner[i] === j;
  }
  pairImpactTime(i, j) {
    if (this.hasJustMet(i, j) && this.hasJustMet(j, i)) return INF;
    const start = max(this.time[i], this.time[j]);
    return start + pairTime(...this.path(i, start), ...this.path(j, start));
  }
  wallImpactTime(i, k) {
    if (this.inverseMass[i] === 0 || this.lastPartner[i] === wallBody(k)) return INF;
    const wait = wallTime(this.x[i], this.y[i], this.vx[i], this.vy[i], this.radius[i], this.walls[k]);
    return wait < INF ? this.time[i] + wait : INF; // no number above 1e300 s or so
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
    const [px, py, nx, ny] = this.walls[k];
    return this.vx[i] * nx + this.vy[i] * ny < 0 && (this.x[i] - px) * nx + (this.y[i] - py) * ny <= this.radius[i];
  }
  // Whether two bodies are on the paths that their own impact gave them: what rounding leaves of an approach is none.
  areParting(i, j) {
    return this.hasJustMet(i, j) && (j < 0 || this.hasJustMet(j, i));
  }
  collide(first, second, t) {
    this.moveTo(first, t);
    this.lastPartner[first] = second;
    if (second < 0) return this.collideWall(first, -1 - second);
    this.moveTo(second, t);
    this.lastPartner[second] = first;
    return this.collidePair(first, second);
  }
  v(i) {
    return [this.vx[i], this.vy[i]];
  }
  collidePair(i, j) {
    const dx = this.x[j] - this.x[i],
      dy = this.y[j] - this.y[i],
      bi = this.v(i),
      bj = this.v(j),
      spins = [this.spin[i], this.spin[j]];
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
    };
  }
  collideWall(i, k) {
    const [, , nx, ny] = this.walls[k],
      before = this.v(i),
      along = before[0] * nx + before[1] * ny,
      spin = this.spin[i],
      e = this.wallRestitution;
    if (along < 0) {
      this.vx[i] -= (1 + e) * along * nx;
      this.vy[i] -= (1 + e) * along * ny;
    }
    if (this.wallGrip[0] > 0 && along < 0) this.rubWall(i, k, before, -((1 + e) * along));
    return this.wallRecord(i, k, before, spin);
  }
  rubWall(i, k, before, pressed) {
    const [, , nx, ny] = this.walls[k];
    const rub = frictionImpulse(
      this.wallGrip,
      before[0] * ny - before[1] * nx + this.radius[i] * this.spin[i],
      1 + this.ease[i],
      pressed,
    );
    this.vx[i] -= rub * ny;
    this.vy[i] += rub * nx;
    this.spin[i] -= (rub * this.ease[i]) / this.radius[i];
  }
  wallRecord(i, k, before, spin) {
    const [, , nx, ny] = this.walls[k];
    return {
      time_s: this.time[i],
      first: i,
      second: wallBody(k),
      at: [[this.x[i], this.y[i]]],
      normal: [-nx, -ny],
      before: [before, [0, 0]],
      after: [this.v(i), [0, 0]],
      spins: this.turns ? [spin, 0, this.spin[i], 0] : null,
    };
  }
  positionsAt(t) {
    return Array.from({ length: this.n }, (_, i) => this.path(i, t).slice(0, 2));
  }
  velocities() {
    return Array.from({ length: this.n }, (_, i) => this.v(i));
  }
}
