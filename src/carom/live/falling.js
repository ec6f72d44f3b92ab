// PIC and PIT under gravity: carom/solvers/falling and carom/solvers/plain/instants.py.
import { INF, abs, hypot, max, sqrt, twoDiff, twoSum } from "./arithmetic.js";
import { Ambiguity, ULP, gapResolution, resolutionOf } from "./ambiguity.js";
import { Bodies, frictionImpulse, wallBody } from "./bodies.js";
import { Contacts, held } from "./contacts.js";
import { descentTime, encounterTime, firstFeatureFalling, returnTime } from "./encounter.js";
import { bendOf, gapOf, sizeOf, sizesOf } from "./finite.js";
import { AllPairs, solvePit } from "./flying.js";
import { groundOf, isNeverMet } from "./grounds.js";
import { NEVER, after, between, isAfter, later } from "./instants.js";
import { excess, pairTime, wallGap, wallSpeed } from "./meeting.js";


export class FallingBodies extends Bodies {
  constructor(scene) {
    super(scene);
    this.gravity = scene.gravity_m_s2;
    this.rollingResistance = scene.wall_rolling_resistance ?? 0;
    this.pull = this.planes.map((plane) => plane && wallSpeed(...this.gravity, plane[2], plane[3]));
    this.acceleration = this.inverseMass.map((mass) => (mass ? this.gravity : [0, 0])); // in contact what is left of it
    this.spinRate = this.x.map(() => 0);
    this.instant = this.x.map(() => [0, 0]);
    this.neverMet = this.x.map(() => []); // of the wall that a disc is on, or has left over an end
    this.leaving = this.x.map(() => 0); // the speed along the normal after the last impact
    this.gripped = this.x.map(() => false); // whether friction has taken all of the slip at the last bounce
  }
  stateAt(i, instant) {
    const own = this.instant[i];
    if (this.inverseMass[i] === 0) return this.drivenAt(i, instant[0]);
    if (own[0] === instant[0] && own[1] === instant[1]) return [this.x[i], this.y[i], this.vx[i], this.vy[i]];
    const dt = between(own, instant),
      [gx, gy] = this.acceleration[i];
    return [
      this.x[i] + dt * (this.vx[i] + 0.5 * gx * dt),
      this.y[i] + dt * (this.vy[i] + 0.5 * gy * dt),
      this.vx[i] + gx * dt,
      this.vy[i] + gy * dt,
    ];
  }
  spinAt(i, instant) {
    const rate = this.spinRate[i];
    return rate ? this.spin[i] + rate * between(this.instant[i], instant) : this.spin[i];
  }
  bringTo(i, instant) {
    if (this.inverseMass[i] === 0) {
      [this.x[i], this.y[i], this.vx[i], this.vy[i]] = this.drivenAt(i, instant[0]);
      return;
    }
    this.spin[i] = this.spinAt(i, instant);
    [this.x[i], this.y[i], this.vx[i], this.vy[i]] = this.stateAt(i, instant);
    this.instant[i] = instant;
    this.time[i] = instant[0];
  }
  moveTo(i, t) {
    this.bringTo(i, [t, 0]);
  }
  relativeAcceleration(i, j) {
    const [[ax, ay], [bx, by]] = [this.acceleration[i], this.acceleration[j]];
    return [ax - bx, ay - by];
  }
  fallAlike(i, j) {
    const [[ax, ay], [bx, by]] = [this.acceleration[i], this.acceleration[j]];
    return ax === bx && ay === by;
  }
  nextPairImpact(i, j) {
    if (this.inverseMass[i] === 0 || this.inverseMass[j] === 0)
      return this.inverseMass[i] === 0 ? this.nextOnFixed(j, i) : this.nextOnFixed(i, j);
    const isAlike = this.fallAlike(i, j),
      justMet = this.haveJustMet(i, j);
    if (justMet && isAlike) return NEVER;
    const start = later(this.instant[i], this.instant[j]),
      one = this.stateAt(i, start),
      other = this.stateAt(j, start);
    if (isAlike) return after(start, pairTime(...one, this.radius[i], ...other, this.radius[j]));
    const seen = [...one.map((a, k) => a - other[k]), this.radius[i]],
      leaving = justMet ? this.leaving[i] : null;
    return after(
      start,
      encounterTime(seen, [0, 0, this.radius[j]], this.relativeAcceleration(i, j), leaving),
    );
  }
  // Two movable discs fall alike; a fall onto what does not fall comes back.
  areParting(i, j) {
    return j >= 0 && this.inverseMass[i] > 0 && this.inverseMass[j] > 0 && super.areParting(i, j);
  }
  // The instant before which two that do not fall alike can't meet; null for two that do.
  earliestOfPair(i, j) {
    const fixed = [i, j].filter((disc) => this.inverseMass[disc] === 0);
    if (fixed.length === 2 || (!fixed.length && this.fallAlike(i, j))) return null;
    const start = [i, j].filter((disc) => !fixed.includes(disc)).map((disc) => this.instant[disc]).reduce(later);
    if (!fixed.includes(i) && this.lastPartner[i] === j) return start;
    if (!fixed.includes(j) && this.lastPartner[j] === i) return start;
    const [x, y, vx, vy] = this.stateAt(i, start),
      [fx, fy, fvx, fvy] = this.stateAt(j, start);
    let gap = hypot(x - fx, y - fy) - (this.radius[i] + this.radius[j]);
    gap -= gapResolution(sizeOf(x, y, this.radius[i]) + sizeOf(fx, fy, this.radius[j]));
    if (!(gap > 0)) return start;
    const pull = hypot(...this.relativeAcceleration(i, j)),
      path = this.driven[j] ?? this.driven[i];
    let speed = hypot(vx - fvx, vy - fvy);
    if (path?.length > 1)
      speed = hypot(vx, vy) + hypot(fvx, fvy) + Math.max(...path.map(({ velocity }) => hypot(...velocity)));
    if (speed === 0 && pull === 0) return NEVER;
    return after(start, 0.99 * ((2 * gap) / (speed + sqrt(speed * speed + 2 * pull * gap))));
  }
  nextOnFixed(i, fixed) {
    if (this.inverseMass[i] === 0) return NEVER;
    for (const [number, leg] of this.legsAhead(fixed, this.time[i]).entries()) {
      const begin = number ? [leg.begin, 0] : this.instant[i],
        [x, y, vx, vy] = this.stateAt(i, begin),
        [atX, atY, driveX, driveY] = this.driven[fixed]
          ? this.drivenOn(fixed, leg, begin[0])
          : this.stateAt(fixed, begin),
        disc = [x, y, vx - driveX, vy - driveY, this.radius[i]],
        leaving = number === 0 && this.lastPartner[i] === fixed ? this.leaving[i] : null,
        wait = encounterTime(disc, [atX, atY, this.radius[fixed]], this.acceleration[i], leaving),
        met = after(begin, wait);
      if (met[0] < leg.end) return met;
    }
    return NEVER;
  }
  nextWallImpact(i, k) {
    if (this.inverseMass[i] === 0) return NEVER;
    for (const [number, leg] of this.legsAhead(wallBody(k), this.time[i]).entries()) {
      const begin = number ? [leg.begin, 0] : this.instant[i],
        met = after(begin, this.waitForWall(i, k, leg, begin[0], number === 0));
      if (met[0] < leg.end) return met;
    }
    return NEVER;
  }
  waitForWall(i, k, leg, begin, justLeft) {
    const plane = this.planes[k],
      hasLeft = justLeft && this.lastPartner[i] === wallBody(k);
    if (plane && hasLeft) {
      const pull = this.pullOf(i, k);
      return pull[0] < 0 ? returnTime([this.leaving[i], 0], pull) : INF;
    }
    const seen = justLeft ? this.seenFrom(i, k) : this.seenOn(i, leg, begin),
      [x, y, vx, vy] = seen;
    if (plane) {
      const gap = wallGap(x, y, this.radius[i], plane);
      return descentTime(gap, wallSpeed(vx, vy, plane[2], plane[3]), this.pullOf(i, k));
    }
    const never = this.neverMet[i],
      every = this.finite[k].features,
      features = never.length ? every.filter((feature) => !isNeverMet(never, feature)) : every,
      last = hasLeft ? this.lastFeature(i, k) : null,
      leaving = hasLeft ? this.leaving[i] : 0,
      next = firstFeatureFalling(this.moverOf(i, seen), features, this.acceleration[i], last, leaving);
    if (next.feature) this.expected[i][k] = next;
    return next.time;
  }
  pullOf(i, k) {
    if (this.acceleration[i] === this.gravity) return this.pull[k];
    return wallSpeed(...this.acceleration[i], ...this.normal(i, k));
  }
  // Whether a disc comes back to what it has left, where that is flat: with the speed that it left with.
  returnsTo(i, k, t) {
    if (this.lastPartner[i] !== wallBody(k) || this.legsAhead(wallBody(k), this.time[i])[0].end <= t) return false;
    const last = this.lastFeature(i, k);
    return this.finite[k] === null || (last?.kind === "face" && this.expected[i][k].feature === last);
  }
  // Speed at which a disc, brought there, meets a wall; acceleration and resolution of their gap.
  contactWithWall(i, k, again) {
    const plane = this.planes[k],
      disc = plane ? null : this.mover(i, k),
      feature = plane ? null : this.expected[i][k].feature;
    if (!plane) this.lastHit[i] = this.hit(i, k);
    const [nx, ny] = this.normal(i, k),
      [, , vx, vy] = this.seenFrom(i, k),
      approach = again ? this.leaving[i] : -wallSpeed(vx, vy, nx, ny)[0];
    if (plane) return [approach, this.pullOf(i, k)[0], this.resolution(i, plane[0], plane[1], 0)];
    const passing = vx * ny - vy * nx,
      [ax, ay] = this.acceleration[i],
      own = sizesOf(feature),
      sizes = feature.kind === "arc" ? feature.halfWidth + ULP * own : own;
    return [
      approach,
      ax * nx + ay * ny + passing * passing * bendOf(feature, disc),
      gapResolution(sizeOf(disc.x[0], disc.y[0], disc.radius) + sizes),
    ];
  }
  // How well a gap is known: `gap_resolution` of carom/solvers/impact/resolution.py, of the sizes of both bodies.
  resolution(i, x, y, radius) {
    return gapResolution(sizeOf(this.x[i], this.y[i], this.radius[i]) + sizeOf(x, y, radius));
  }
  contactWithDisc(i, j) {
    const dx = this.x[i] - this.x[j],
      dy = this.y[i] - this.y[j],
      ux = this.vx[i] - this.vx[j],
      uy = this.vy[i] - this.vy[j],
      [ax, ay] = this.relativeAcceleration(i, j),
      d = hypot(dx, dy);
    const opening = (dx * ux + dy * uy) / d,
      passing = (dx * uy - dy * ux) / d,
      pull = (dx * ax + dy * ay) / d + (passing * passing) / d;
    return [-opening, pull, this.resolution(i, this.x[j], this.y[j], this.radius[j])];
  }
  leaveFixed(i, f) {
    const dx = this.x[i] - this.x[f],
      dy = this.y[i] - this.y[f],
      d = hypot(dx, dy),
      reach = twoSum(this.radius[i], this.radius[f]);
    const beyond = excess(twoDiff(this.x[i], this.x[f]), twoDiff(this.y[i], this.y[f]), reach)[0],
      part = beyond / ((d + reach[0]) * d);
    this.x[i] -= part * dx;
    this.y[i] -= part * dy;
  }
  part(i, j, approach) {
    this.lastPartner[i] = j;
    this.lastPartner[j] = i;
    this.leaving[i] = this.leaving[j] = this.restitution * max(0, approach);
  }
  bounce(i, k, approach) {
    const plane = this.planes[k],
      [nx, ny] = this.normal(i, k),
      before = this.v(i),
      spin = this.spin[i],
      e = this.wallRestitution[k],
      [x, y, vx, vy] = this.seenFrom(i, k);
    const gap = plane
      ? wallGap(x, y, this.radius[i], plane)[0]
      : gapOf(this.mover(i, k), this.expected[i][k].feature);
    this.x[i] -= gap * nx;
    this.y[i] -= gap * ny;
    this.gripped[i] = false;
    if (approach > 0) {
      this.leaveWall(i, k, e * approach);
      if (this.rubsOn(k)) this.rubWall(i, k, [vx, vy], (1 + e) * approach);
    }
    this.lastPartner[i] = wallBody(k);
    return this.wallRecord(i, k, before, spin);
  }
  rubsOn(k) {
    return super.rubsOn(k) || this.rollingResistance > 0;
  }
  rubWall(i, k, before, pressed) {
    const [nx, ny] = this.normal(i, k),
      ease = this.ease[i],
      rim = this.radius[i] * this.spin[i],
      slip = this.slipOn(i, k, before),
      by = this.rubbed(this.wallGrip[k], slip, rim, ease, pressed);
    this.gripped[i] = by.slip;
    this.vx[i] -= by.friction * ny;
    this.vy[i] += by.friction * nx;
    this.spin[i] = by.rim ? 0 : this.spin[i] - ((by.friction + by.rolling) * ease) / this.radius[i];
  }
  rubbed(grip, slip, rim, ease, pressed) {
    if (this.rollingResistance)
      return held(slip, rim, [grip[0] * pressed, this.rollingResistance * pressed], ease);
    const sticks = abs(((1 + grip[1]) * slip) / (1 + ease)) <= grip[0] * pressed;
    return { friction: frictionImpulse(grip, slip, 1 + ease, pressed), rolling: 0, slip: sticks, rim: false };
  }
  // A disc leaves a vertex, along which its rim moves: the gap and its rate are 0.
  touchVertex(i, k, vertex) {
    const dx = this.x[i] - vertex.at[0],
      dy = this.y[i] - vertex.at[1],
      distance = hypot(dx, dy);
    this.lastPartner[i] = wallBody(k);
    this.leaving[i] = 0;
    this.lastHit[i] = { feature: vertex, normal: [dx / distance, dy / distance], edge: [-1, -1], again: false };
  }
  leaveWall(i, k, speed) {
    const [nx, ny] = this.normal(i, k),
      [, , vx, vy] = this.seenFrom(i, k),
      change = speed - wallSpeed(vx, vy, nx, ny)[0];
    this.vx[i] += change * nx;
    this.vy[i] += change * ny;
    this.leaving[i] = speed;
  }
}

// carom/solvers/falling/run.py: it goes on where gravity presses a disc to a half-plane, and ends at other contact.
class Falling extends AllPairs {
  constructor(scene) {
    super(scene, new FallingBodies(scene), INF);
    this.contacts = new Contacts(this.bodies);
    this.bounded = new Set(); // pairs that meet at the instant kept of them at the earliest
    this.modes = [];
    this.struck = []; // how those go on that the impact found in contact
    this.ambiguity = new Ambiguity(this.bodies);
    this.known = 0; // to how many seconds the instant of the last impact is known
    this.unresolved = 0;
  }
  begin() {
    super.begin();
    for (const [disc, mode] of this.contacts.begin()) this.goOn(disc, mode);
  }
  ended(until) {
    if (this.outcome === "completed") this.now = later(this.now, [this.end, 0]);
    const { impacts, outcome, modes, bodies, now } = this;
    return { impacts, outcome, end_s: until, modes: modes.length ? modes : null, ...bodies.allAt(now) };
  }
  // What comes first; where a mode ends, its disc stands for both bodies.
  next() {
    const key = ([, one, other]) => one * this.bodies.n + other;
    let found = super.next();
    while (found[2] >= 0 && this.bounded.delete(key(found))) {
      super.expect(found[1], found[2]);
      found = super.next();
    }
    const { ends } = this.contacts,
      soonest = ends.reduce((a, b) => (isAfter(a, b) ? b : a)),
      disc = ends.indexOf(soonest);
    return soonest[0] < INF && !isAfter(soonest, found[0]) ? [soonest, disc, disc] : found;
  }
  carryOut(one, other, instant) {
    if (one !== other) {
      super.carryOut(one, other, instant);
      return;
    }
    this.now = later(this.now, instant);
    this.reported = this.sinceStart(this.now[0]);
    this.bodies.bringTo(one, this.now);
    const mode = this.contacts.endMode(one);
    if (mode === null) this.outcome = "edge";
    else this.goOn(one, mode);
  }
  goOn(disc, mode) {
    this.keepMode(mode);
    this.predict(disc, () => true);
  }
  keepMode(mode) {
    this.modes.push({ ...mode, time_s: this.reported, impacts: this.impacts.length });
  }
  // Solving for two that do not fall alike costs much: until its turn comes it is bounded.
  expect(one, other) {
    const earliest = other < 0 ? null : this.bodies.earliestOfPair(one, other);
    if (other >= 0) this.bounded.delete(one * this.bodies.n + other);
    if (earliest !== null) {
      this.keep(one, other, earliest);
      this.bounded.add(one * this.bodies.n + other);
      return;
    }
    const ground = other < 0 ? this.contacts.grounds[one] : null;
    if (ground && !ground.face && ground.wall === -1 - other) this.keep(one, other, NEVER);
    else super.expect(one, other);
  }
  collide(one, other, moved) {
    const record = other < 0 ? this.meetWall(one, -1 - other) : this.meetDisc(one, other);
    if (record) this.struck = moved.map((disc) => this.contacts.afterImpact(disc)).filter((mode) => mode);
    return record;
  }
  recorded() {
    const ambiguous = this.ambiguity.add(this.impacts.at(-1), this.known);
    for (const mode of this.struck) this.keepMode(mode);
    this.unresolved = ambiguous ? this.unresolved + 1 : 0;
    if (max(this.atInstant, this.unresolved) > this.standstill) this.outcome = "standstill";
  }
  meetDisc(i, j) {
    const b = this.bodies,
      last = b.haveJustMet(i, j) ? later(b.instant[i], b.instant[j]) : null;
    for (const disc of [i, j]) b.bringTo(disc, this.now);
    const fixed = [i, j].some((disc) => b.inverseMass[disc] === 0),
      [one, other] = b.inverseMass[i] === 0 ? [j, i] : [i, j],
      [approach, pull, gap] = b.contactWithDisc(one, other);
    if ((fixed || !b.fallAlike(i, j)) && this.isAtRest(approach, pull, gap, fixed ? null : last)) {
      this.endInContact(one, other);
      return null;
    }
    b.part(i, j, approach);
    const record = b.collidePair(i, j);
    this.known = resolutionOf(b, record);
    if (fixed) b.leaveFixed(one, other);
    return record;
  }
  meetWall(i, k) {
    const b = this.bodies,
      again = b.returnsTo(i, k, this.now[0]),
      last = again ? b.instant[i] : null;
    b.bringTo(i, this.now);
    const [approach, pull, gap] = b.contactWithWall(i, k, again);
    if (!this.isAtRest(approach, pull, gap, last)) {
      const record = b.bounce(i, k, approach);
      this.known = again ? 0 : resolutionOf(b, record);
      return record;
    }
    const ground = groundOf(b, k, b.expected[i][k]?.feature);
    if (this.contacts.grounds[i] !== null || ground === null) {
      b.leaveWall(i, k, 0);
      this.endInContact(i, wallBody(k));
    } else this.goOn(i, this.contacts.land(i, ground, approach));
    return null;
  }
  isAtRest(approach, pull, gap, last) {
    if (!(pull < 0) || !(approach > 0)) return pull < 0;
    return last !== null ? last[0] === this.now[0] : approach * approach <= -2 * pull * gap;
  }
  endInContact(i, other) {
    const pressed = other >= 0 && this.bodies.inverseMass[other] > 0;
    this.outcome = pressed ? "pressed" : this.contacts.grounds[i] !== null ? "corner" : "at_rest";
  }
}
export const solvePicFalling = (scene, maxImpacts = INF) => new Falling(scene).run(maxImpacts);
export const solvePitFalling = (scene, rate, options = {}) =>
  solvePit(scene, rate ?? scene.frame_rate_hz, { ...options, bodies: new FallingBodies(scene) });
