// Discs that gravity presses to a half-plane: how they slide, roll or rest there, and when that changes.
// carom/solvers/falling/contacts.py and carom/physics/contact_law.py.
import { INF, abs } from "./arithmetic.js";
import { wallBody } from "./bodies.js";
import { sameFeature } from "./features.js";
import { groundsOf } from "./grounds.js";
import { NEVER, after, isAfter } from "./instants.js";
import { wallSpeed } from "./meeting.js";

export const MODES = ["flight", "slide", "roll", "rest", "block"];
const [FLIGHT, SLIDE, ROLL, REST, BLOCK] = MODES.keys();
const copysign = (size, sign) => (sign < 0 || Object.is(sign, -0) ? -abs(size) : abs(size));
const cutTo = (x, most) => (x > most ? most : x < -most ? -most : x);

// What two frictions take, of at most `most`, and what they hold at 0; signs that slip and rim have already fix theirs.
export function held(s1, q1, [frictionMost, rollingMost], y, [slip, rim] = [0, 0]) {
  const own = slip > 0 ? frictionMost : -frictionMost;
  let friction = 0 * s1,
    rolling = friction,
    rimHeld = false;
  if (y && rim) rolling = rim > 0 ? rollingMost : -rollingMost;
  else if (y && rollingMost) {
    friction = slip ? own : cutTo(s1 - q1, frictionMost);
    rolling = cutTo(q1 / y - friction, rollingMost);
    rimHeld = abs(q1 / y - friction) <= rollingMost;
  }
  if (slip) return { friction: own, rolling, slip: false, rim: rimHeld };
  const left = s1 - rolling * y;
  if (abs(left) <= frictionMost * (1 + y)) return { friction: left / (1 + y), rolling, slip: true, rim: rimHeld };
  return { friction: left > 0 ? frictionMost : -frictionMost, rolling, slip: false, rim: rimHeld };
}
// Rates of the speed along the wall and of the rim's, and whether slip and rim are held at 0.
function rates({ normal, along, friction, ease, resistance }, slip, rim) {
  const most = [friction * normal, resistance * normal],
    by = held(along, 0, most, ease, [slip, most[1] ? rim : 0]),
    turns = by.rim ? 0 : 0 - (by.friction + by.rolling) * ease;
  return by.slip ? [0 - turns, turns, true, by.rim] : [along - by.friction, turns, false, by.rim];
}
const zeroAfter = (value, rate) => (value !== 0 && value * rate < 0 ? -value / rate : INF);
// What is left of slip and rim's speed after infinitely many bounces with rolling resistance, taken as one.
function leftOfBoth({ normal, along, friction, ease, resistance }, slip, rim, approach, restitution) {
  const left = approach / (1 - restitution),
    pressed = (1 + restitution) * left,
    fallen = (2 * restitution * left) / normal,
    s1 = slip + along * fallen,
    by = held(s1, rim, [friction * pressed, resistance * pressed], ease);
  return [
    by.slip ? 0 : s1 - by.friction * (1 + ease) - by.rolling * ease,
    by.rim ? 0 : rim - (by.friction + by.rolling) * ease,
  ];
}
// The slip at the end of the infinitely many bounces that begin now.
function leftOfSlip({ normal, along, friction, ease }, slip, approach, restitution) {
  if (slip === 0) return 0;
  const most = friction * (1 + restitution) * (1 + ease),
    hop = (2 * along * restitution) / normal;
  if (abs(slip) <= most * approach) {
    if (abs(hop) <= most * restitution) return 0;
    slip = hop * approach;
    approach = approach * restitution;
  }
  const sign = copysign(1, slip),
    left = slip + ((hop - sign * most) * approach) / (1 - restitution);
  return left * sign > 0 ? left : 0;
}

export class Contacts {
  constructor(bodies) {
    this.bodies = bodies;
    this.grounds = bodies.x.map(() => null);
    this.modes = bodies.x.map(() => FLIGHT);
    this.ends = bodies.x.map(() => NEVER);
    this.zero = bodies.x.map(() => [true, false]); // whether slip and rim are 0 where a mode ends
    this.over = bodies.x.map(() => NEVER); // when each comes to the end of its face
  }
  *begin() {
    const b = this.bodies;
    for (let i = 0; i < b.n; i++)
      for (const ground of b.inverseMass[i] > 0 ? groundsOf(b, i) : []) {
        const pull = -this.press(i, ground).normal,
          known = this.known(i, ground),
          approach = this.approach(i, ground),
          gap = ground.gapOf(b, i),
          touches = -b.radius[i] < gap && gap <= known;
        if (this.grounds[i] === null && touches && pull < 0 && approach * approach <= -2 * pull * known)
          yield [i, this.land(i, ground, approach)];
      }
  }
  land(i, ground, approach) {
    const b = this.bodies,
      e = b.wallRestitution[ground.wall],
      press = this.press(i, ground),
      // What an impact has given back of a slip is left; what infinitely many leave of it, leftOfSlip says.
      gripped = b.gripped[i] && b.lastPartner[i] === wallBody(ground.wall) && b.wallGrip[ground.wall][1] === 0,
      bounces = approach > 0 && e < 1;
    let slip = this.slip(i, ground),
      rim = this.rim(i),
      by = 0;
    if (press.resistance && bounces) {
      const speed = slip - rim,
        [left, leftOfRim] = leftOfBoth(press, gripped ? 0 : slip, rim, approach, e);
      if (left === 0) [by, slip, rim] = [speed + leftOfRim, 0, leftOfRim];
      else if (leftOfRim === 0) [slip, rim] = [speed, 0];
    } else if (gripped) {
      slip = 0; // what is left of it is rounding
    } else if (bounces && leftOfSlip(press, slip, approach, e) === 0) {
      by = slip / (1 + press.ease);
      slip = 0;
    }
    // By friction, from the disc and from its rim.
    if (by) this.pushAlong(i, ground, by);
    b.lastPartner[i] = null;
    return this.settle(i, ground, slip, rim);
  }
  pushAlong(i, ground, by) {
    const b = this.bodies,
      [nx, ny] = ground.normal;
    b.vx[i] -= by * ny;
    b.vy[i] += by * nx;
  }
  // Null where a disc has come to the end of its face, and does not fly off.
  endMode(i) {
    const [slip, rim] = this.zero[i],
      ground = this.grounds[i];
    this.bodies.lastPartner[i] = null;
    if (!isAfter(this.over[i], this.bodies.instant[i])) return this.leaveAtEnd(i, ground);
    return this.settle(i, ground, slip ? 0 : this.slip(i, ground), rim ? 0 : this.rim(i));
  }
  // A disc that was struck stays in contact, or leaves its wall; null where only its velocity has changed.
  afterImpact(i) {
    const b = this.bodies,
      ground = this.grounds[i];
    b.neverMet[i] = [];
    if (ground === null) return null;
    const approach = this.approach(i, ground);
    if (approach * approach <= 2 * this.press(i, ground).normal * this.known(i, ground)) {
      const how = () => [this.modes[i], ...b.acceleration[i], b.spinRate[i]],
        was = how(),
        settled = this.settle(i, ground, this.slip(i, ground), this.rim(i));
      return how().every((x, n) => x === was[n]) ? null : settled;
    }
    this.setOn(i, ground);
    return this.takeOff(i, ground);
  }
  leaveAtEnd(i, ground) {
    const b = this.bodies,
      vertex = ground.setAtEnd(b, i);
    if (vertex === null || !ground.fliesOver(b, i, vertex)) return null;
    const record = this.takeOff(i, ground);
    b.touchVertex(i, ground.wall, vertex);
    b.neverMet[i] = ground.never.filter((one) => one.kind !== "arc" && !sameFeature(one, vertex));
    return record;
  }
  takeOff(i, ground) {
    const b = this.bodies,
      before = this.modes[i];
    this.grounds[i] = null;
    this.modes[i] = FLIGHT;
    this.ends[i] = NEVER;
    b.acceleration[i] = b.gravity;
    b.spinRate[i] = 0;
    return this.record(i, ground.wall, before);
  }
  press(i, { wall, normal: [nx, ny] }) {
    const b = this.bodies;
    return {
      normal: -wallSpeed(...b.gravity, nx, ny)[0],
      along: wallSpeed(...b.gravity, ny, -nx)[0],
      friction: b.wallGrip[wall][0],
      ease: b.ease[i],
      resistance: b.ease[i] ? b.rollingResistance : 0,
    };
  }
  approach(i, { normal }) {
    return -wallSpeed(this.bodies.vx[i], this.bodies.vy[i], ...normal)[0];
  }
  // How well the gap is known, metres.
  known(i, { plane: [qx, qy] }) {
    return this.bodies.resolution(i, qx, qy, 0);
  }
  rim(i) {
    return this.bodies.radius[i] * this.bodies.spin[i];
  }
  slip(i, { normal: [nx, ny] }) {
    const b = this.bodies;
    return b.vx[i] * ny - b.vy[i] * nx + b.radius[i] * b.spin[i];
  }
  setOn(i, ground) {
    const b = this.bodies,
      [nx, ny] = ground.normal,
      gap = ground.gapOf(b, i);
    b.x[i] -= gap * nx;
    b.y[i] -= gap * ny;
  }
  settle(i, ground, slip, rim) {
    const b = this.bodies,
      before = this.modes[i],
      [nx, ny] = ground.normal;
    this.setOn(i, ground);
    const press = this.press(i, ground),
      resists = press.resistance > 0;
    let speed = b.vx[i] * ny - b.vy[i] * nx;
    if (resists && slip === 0) {
      speed = rim ? speed : 0;
      rim = 0 - speed;
    }
    const [along, turns, holds, rimHolds] = rates(press, slip, rim);
    if (holds) {
      speed = press.ease ? speed : 0;
      b.spin[i] = 0 - speed / b.radius[i];
    } else if (resists && rim === 0) b.spin[i] = 0;
    b.vx[i] = speed * ny;
    b.vy[i] = 0 - speed * nx;
    b.acceleration[i] = [along * ny, 0 - along * nx];
    b.spinRate[i] = turns / b.radius[i];
    b.neverMet[i] = ground.never;
    this.grounds[i] = ground;
    this.modes[i] = holds ? (speed || along ? ROLL : REST) : rimHolds ? BLOCK : SLIDE;
    const waits = [zeroAfter(slip, along + turns), resists ? zeroAfter(rim, turns) : INF],
      soonest = Math.min(...waits);
    this.zero[i] = waits.map((wait) => wait === soonest || (holds && resists));
    const zero = after(b.instant[i], soonest),
      over = after(b.instant[i], ground.endsAfter(b, i, speed, along));
    this.ends[i] = isAfter(zero, over) ? over : zero;
    this.over[i] = isAfter(zero, over) ? over : NEVER;
    return this.record(i, ground.wall, before);
  }
  record(i, k, before) {
    const b = this.bodies;
    return {
      disc: i,
      wall: wallBody(k),
      before,
      after: this.modes[i],
      at: [b.x[i], b.y[i]],
      velocity: b.v(i),
      acceleration: b.acceleration[i],
      spin: b.spin[i],
      spin_rate: b.spinRate[i],
    };
  }
}
