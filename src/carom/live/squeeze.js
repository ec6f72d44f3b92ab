// Discs that bounce to and fro between what closes on them, without end: carom/solvers/plain/squeeze.py.
import { abs, hypot, sqrt } from "./arithmetic.js";
import { wallBody } from "./bodies.js";
import { movedOn } from "./driving.js";
import { gapOf } from "./finite.js";

// Sides of a disc by a normal, in which -0 and 0 are one.
const sideOf = ([x, y]) => `${x + 0} ${y + 0}`;

export class Squeezes {
  constructor(bodies, most) {
    this.bodies = bodies;
    this.most = most;
    this.last = bodies.x.map(() => null);
    this.sides = bodies.x.map(() => ({})); // whom each disc struck last on either side
    this.row = bodies.x.map(() => 0);
  }
  // Notes that a disc has struck a body, the normal from that to it; when it is crushed, since the epoch, or Infinity.
  struck(disc, other, normal) {
    const last = this.last[disc],
      facing = last !== null && last[1][0] === -normal[0] && last[1][1] === -normal[1],
      opposite = facing && last[0] !== other,
      // A disc of a row may strike the one beside it twice before it is back at the other.
      again = other >= 0 && last !== null && last[0] === other && sideOf(last[1]) === sideOf(normal);
    this.last[disc] = [other, normal];
    this.row[disc] = opposite || again ? this.row[disc] + 1 : 0;
    this.sides[disc] = { ...(this.row[disc] ? this.sides[disc] : {}), [sideOf(normal)]: other };
    if (last === null || this.row[disc] <= this.most) return Infinity;
    if (other < 0 && last[0] < 0) return this.crushed(disc, -1 - other, -1 - last[0]);
    return this.crushedInARow(disc, normal);
  }
  // Nothing else may come near till then, nor may a wall go on to another leg of its path.
  crushed(i, k, other) {
    const b = this.bodies,
      [nx, ny] = b.normal(i, k),
      now = b.time[i],
      between = [k, other],
      legs = between.map((wall) => b.legsAhead(wallBody(wall), now)[0]),
      [[ax, ay], [bx, by]] = legs.map(({ velocity }) => velocity),
      closing = (ax - bx) * nx + (ay - by) * ny,
      slip = abs(b.vx[i] * ny - b.vy[i] * nx) + Math.max(...legs.map(({ velocity }) => hypot(...velocity)));
    if (!(closing > 0)) return Infinity;
    const gap = this.gap(i, other);
    if (gap === null) return Infinity;
    const left = gap / closing;
    if (legs.some(({ end }) => end <= now + left) || this.isDisturbed(i, between.map(wallBody), gap + left * slip, left)) return Infinity;
    const bounded = between.filter((wall) => !b.planes[wall]),
      rubs = between.some((wall) => b.wallGrip[wall][0] > 0);
    if ((bounded.length && rubs) || !bounded.every((wall) => this.stays(i, wall, left))) return Infinity;
    return now + left;
  }
  // The same of a disc and those that it strikes, in a row between two half-planes or held discs: on one line to the bit,
  // which is one along an axis, with no speed across it, where nothing rubs, falls or is lost.
  crushedInARow(i, normal) {
    const b = this.bodies,
      now = b.time[i],
      line = this.inARow(i, normal);
    if (line === null || b.grip[0] > 0 || b.restitution < 1 || b.gravity.some(Boolean) || (normal[0] && normal[1]))
      return Infinity;
    const along = normal[0] ? 0 : 1,
      states = line.map((body) => this.inLine(body, now, normal));
    if (states.includes(null) || states.some((state) => state[3 - along])) return Infinity;
    if (new Set(line.flatMap((body, n) => (body < 0 ? [] : [states[n][1 - along]]))).size > 1) return Infinity;
    const ends = [states[0], states.at(-1)],
      closing = (ends[0][2 + along] - ends[1][2 + along]) * normal[along];
    let room = (ends[1][along] - ends[0][along]) * normal[along];
    for (const body of line) if (body >= 0) room -= b.radius[body] * (b.inverseMass[body] ? 2 : 1);
    room = Math.max(0, room);
    if (!(closing > 0)) return Infinity;
    const left = room / closing,
      way = room + left * Math.max(...ends.map((end) => abs(end[2 + along])));
    if ([line[0], line.at(-1)].some((body) => b.legsAhead(body, now)[0].end <= now + left)) return Infinity;
    return line.slice(1, -1).some((j) => this.isDisturbed(j, line, way, left)) ? Infinity : now + left;
  }
  // Place and velocity of a body at a time; null for a wall that is not across a line, or takes speed.
  inLine(body, t, normal) {
    const b = this.bodies;
    if (body >= 0) return b.stateAt(body, [t, 0]);
    const k = -1 - body,
      wall = b.planes[k],
      [leg] = b.legsAhead(body, t);
    if (!wall || b.rubsOn(k) || b.wallRestitution[k] < 1 || wall[2] * normal[1] !== wall[3] * normal[0]) return null;
    const [movedX, movedY] = movedOn(leg, t);
    return [wall[0] + movedX, wall[1] + movedY, ...leg.velocity];
  }
  // A disc and who strikes whom beside it, in the order of the normal, up to a body at each end that no impact moves.
  inARow(i, normal) {
    const b = this.bodies,
      ways = [normal, normal.map((value) => -value)].map(sideOf).map((side) => {
        const way = [];
        let body = this.sides[i][side];
        while (body !== undefined && way.length <= b.n) {
          way.push(body);
          if (body < 0 || !b.inverseMass[body]) return way;
          body = this.sides[body][side];
        }
        return null;
      });
    return ways.includes(null) ? null : [...ways[0].reverse(), i, ...ways[1]];
  }
  // Whether another body may come so soon to a disc, which gets this far beside its fall, as all move now.
  isDisturbed(i, among, reach, seconds) {
    const b = this.bodies,
      now = b.time[i],
      fall = 0.5 * hypot(...b.gravity) * seconds * seconds,
      speedOf = ({ velocity }) => hypot(...velocity),
      fastest = (body) => Math.max(...b.legsAhead(body, now).map(speedOf)),
      way = reach + fall;
    for (const k of b.planes.keys())
      if (!among.includes(wallBody(k)) && this.room(i, k) <= way + fastest(wallBody(k)) * seconds) return true;
    for (let j = 0; j < b.n; j++) {
      const [x, y, u, v] = b.stateAt(j, [now, 0]),
        room = hypot(x - b.x[i], y - b.y[i]) - b.radius[i] - b.radius[j];
      if (j !== i && !among.includes(j) && room <= way + fall + Math.max(hypot(u, v), fastest(j)) * seconds) return true;
    }
    return false;
  }
  room(i, k) {
    const b = this.bodies,
      plane = b.planes[k],
      [x, y] = b.seenFrom(i, k);
    if (plane) return (x - plane[0]) * plane[2] + (y - plane[1]) * plane[3] - b.radius[i];
    const { outline } = b.finite[k],
      { at } = outline.nearest(x, y);
    return sqrt((x - at[0]) ** 2 + (y - at[1]) ** 2) - outline.halfWidth - b.radius[i];
  }
  face(i, k) {
    const feature = this.bodies.expected[i][k]?.feature;
    return feature?.kind === "face" ? feature : null;
  }
  gap(i, k) {
    if (this.bodies.planes[k]) return this.room(i, k);
    const face = this.face(i, k);
    return face && gapOf(this.bodies.mover(i, k), face);
  }
  // Whether a disc is before a finite wall from now on for some seconds, along the wall.
  stays(i, k, seconds) {
    const face = this.face(i, k);
    if (face === null) return false;
    const [x, y, vx, vy] = this.bodies.seenFrom(i, k),
      [gx, gy] = this.bodies.gravity,
      ex = face.b[0] - face.a[0],
      ey = face.b[1] - face.a[1],
      now = (x - face.a[0]) * ex + (y - face.a[1]) * ey,
      rate = vx * ex + vy * ey,
      pull = gx * ex + gy * ey,
      turns = pull ? -rate / pull : 0,
      times = [0, seconds, ...(0 < turns && turns < seconds ? [turns] : [])];
    return times
      .map((t) => now + t * (rate + 0.5 * pull * t))
      .every((along) => 0 <= along && along <= ex * ex + ey * ey);
  }
}
