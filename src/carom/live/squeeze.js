// Discs that bounce to and fro between what closes on them, without end: carom/solvers/plain/squeeze.py.
import { abs, hypot, sqrt } from "./arithmetic.js";
import { wallBody } from "./bodies.js";
import { movedOn } from "./driving.js";
import { gapOf } from "./finite.js";

const isSame = ([ax, ay], [bx, by]) => ax === bx && ay === by;
const back = ([nx, ny]) => [-nx, -ny];
// The component of a vector across a normal along an axis.
const acrossAxis = ([x, y], [nx]) => (nx ? y : x);

// A point of what lies across a line, and how far before it its surface is; null where it does not.
const onPlane = ([x, y, ...facing], normal) => (acrossAxis(facing, normal) ? null : [[x, y], 0]);
function onFeature(feature, [x, y], [movedX, movedY], normal) {
  const { kind, halfWidth } = feature;
  if (kind === "face") {
    const { a, b } = feature,
      leans = acrossAxis([b[1] - a[1], a[0] - b[0]], normal);
    return isSame(feature.normal, normal) && !leans ? [a, halfWidth] : null;
  }
  const at = kind === "vertex" ? feature.at : feature.centre.map(([high]) => high),
    radius = kind === "vertex" ? 0 : feature.inside ? -feature.radius[0] : feature.radius[0];
  return acrossAxis([x - movedX - at[0], y - movedY - at[1]], normal) ? null : [at, halfWidth + radius];
}

export class Squeezes {
  constructor(bodies, most) {
    this.bodies = bodies;
    this.most = most;
    // What each disc struck last, the normal from there, what it struck last on the other side, and how often in a row.
    this.toAndFro = bodies.x.map(() => ({ last: null, normal: [0, 0], across: null, row: 0 }));
  }
  // Notes that a disc has struck a body, the normal from that to it; when it is crushed, since the epoch, or Infinity.
  struck(disc, other, normal) {
    const feature = other < 0 ? (this.bodies.lastHit[disc]?.feature ?? null) : null;
    this.toAndFro[disc] = this.after(this.toAndFro[disc], { body: other, feature }, normal);
    const { last, across: opposite, row } = this.toAndFro[disc];
    if (row <= this.most || opposite === null) return Infinity;
    const between = last.body < 0 && opposite.body < 0 ? this.crushed(disc, -1 - last.body, -1 - opposite.body) : Infinity;
    return between < Infinity ? between : this.crushedInARow(disc, normal);
  }
  after(before, struck, normal) {
    const { last, row } = before;
    if (last !== null && last.body !== struck.body && isSame(before.normal, back(normal)))
      return { last: struck, normal, across: last, row: row + 1 };
    // A disc of a row may strike the one beside it twice before it is back at the other.
    if (last !== null && struck.body >= 0 && last.body === struck.body && isSame(before.normal, normal))
      return { ...before, row: row + 1 };
    return { last: struck, normal, across: null, row: 0 };
  }
  // What a disc struck last on a side, by the normal from there.
  beside(disc, side) {
    const { last, normal, across: opposite } = this.toAndFro[disc];
    return isSame(side, normal) ? last : isSame(side, back(normal)) ? opposite : null;
  }
  // Nothing else may come near till then, nor may a wall go on to another leg of its path, nor may it get out sideways.
  crushed(i, k, other) {
    const b = this.bodies,
      [nx, ny] = b.normal(i, k),
      now = b.time[i],
      between = [k, other],
      legs = between.map((wall) => b.legsAhead(wallBody(wall), now)[0]),
      [[ax, ay], [bx, by]] = legs.map(({ velocity }) => velocity),
      closing = (ax - bx) * nx + (ay - by) * ny;
    if (!(closing > 0)) return Infinity;
    const gap = this.gap(i, other);
    if (gap === null) return Infinity;
    const left = gap / closing,
      drifts = this.drifts(i, k, other, legs);
    if (!drifts.length || legs.some(({ end }) => end <= now + left)) return Infinity;
    const slip =
      Math.max(...drifts.map(([velocity]) => abs(velocity))) + Math.max(...legs.map(({ velocity }) => hypot(...velocity)));
    if (this.isDisturbed(i, between.map(wallBody), gap + left * slip, left)) return Infinity;
    return between.every((wall) => this.stays(i, wall, [ny, -nx], drifts, left)) ? now + left : Infinity;
  }
  // Bounds of velocity and acceleration along a wall of a disc between it and another; friction never takes it farther,
  // by kinetic energy, from the velocity and spin that slip on neither.
  drifts(i, k, other, legs) {
    const b = this.bodies,
      [nx, ny] = b.normal(i, k),
      along = ([x, y]) => x * ny - y * nx,
      now = along(b.v(i)),
      pull = along(b.gravity);
    if (!b.rubsOn(k) && !b.rubsOn(other)) return [[now, pull]];
    const one = along(legs[0].velocity) - b.belts[k],
      two = along(legs[1].velocity) + b.belts[other],
      steady = (one + two) / 2,
      off = b.radius[i] * b.spin[i] - (one - two) / 2;
    if (off && !b.ease[i]) return [];
    const turning = off ? (off * off) / b.ease[i] : 0,
      most = sqrt((now - steady) * (now - steady) + turning);
    return [
      [steady - most, -abs(pull)],
      [steady + most, abs(pull)],
    ];
  }
  // The same of a disc and those that it strikes, in a row between two bodies that no impact moves: on one line to the
  // bit, which is one along an axis, with no speed, fall or slip across it, and of several where nothing is lost.
  crushedInARow(i, normal) {
    const b = this.bodies,
      now = b.time[i],
      line = this.inARow(i, normal);
    if (line === null || (normal[0] && normal[1]) || acrossAxis(b.gravity, normal)) return Infinity;
    const row = line.map(({ body }) => body),
      walls = row.filter((body) => body < 0).map((body) => -1 - body),
      discs = row.filter((body) => body >= 0);
    if (row.length > 3 && Math.min(b.restitution, ...walls.map((k) => b.wallRestitution[k])) < 1) return Infinity;
    const states = discs.map((body) => b.stateAt(body, [now, 0]));
    if (new Set(states.map((state) => acrossAxis(state, normal))).size > 1) return Infinity;
    if (states.some(([, , ...velocity]) => acrossAxis(velocity, normal)) || this.slips(row, walls, discs)) return Infinity;
    const ends = [this.end(line[0], row[1], normal, now), this.end(line.at(-1), row.at(-2), back(normal), now)];
    if (ends.includes(null)) return Infinity;
    const [[x, y, vx, vy], [toX, toY, toVx, toVy]] = ends,
      closing = (vx - toVx) * normal[0] + (vy - toVy) * normal[1],
      full = row.slice(1, -1).reduce((sum, body) => sum + 2 * b.radius[body], 0),
      room = Math.max(0, (toX - x) * normal[0] + (toY - y) * normal[1] - full);
    if (!(closing > 0)) return Infinity;
    const left = room / closing,
      way = room + left * Math.max(...ends.map(([, , ...velocity]) => hypot(...velocity)));
    if ([row[0], row.at(-1)].some((body) => b.legsAhead(body, now)[0].end <= now + left)) return Infinity;
    return row.slice(1, -1).some((j) => this.isDisturbed(j, row, way, left)) ? Infinity : now + left;
  }
  // Whether the impacts of a row without a speed across it rub.
  slips(row, walls, discs) {
    const b = this.bodies,
      hasPairs = row.length - 1 > walls.length;
    if (!(hasPairs && b.grip[0] > 0) && !walls.some((k) => b.rubsOn(k))) return false;
    return walls.some((k) => b.belts[k]) || discs.some((body) => b.spin[body]);
  }
  // Where the surface of a row's last body is on the line, and its velocity; null for what does not lie across the line.
  end({ body, feature }, disc, normal, t) {
    const b = this.bodies,
      [nx, ny] = normal;
    if (body >= 0) {
      const [x, y, vx, vy] = b.stateAt(body, [t, 0]);
      return [x + b.radius[body] * nx, y + b.radius[body] * ny, vx, vy];
    }
    const plane = b.planes[-1 - body],
      [leg] = b.legsAhead(body, t),
      [movedX, movedY] = movedOn(leg, t);
    if (acrossAxis(leg.velocity, normal) || (!plane && feature === null)) return null;
    const surface = plane ? onPlane(plane, normal) : onFeature(feature, b.stateAt(disc, [t, 0]), [movedX, movedY], normal);
    if (surface === null) return null;
    const [[x, y], depth] = surface;
    return [x + movedX + depth * nx, y + movedY + depth * ny, ...leg.velocity];
  }
  // A disc and who strikes whom beside it, in the order of the normal, up to a body at each end that no impact moves.
  inARow(i, normal) {
    const b = this.bodies,
      ways = [normal, back(normal)].map((side) => {
        const way = [];
        let struck = this.beside(i, side);
        while (struck !== null && way.length <= b.n) {
          way.push(struck);
          if (struck.body < 0 || !b.inverseMass[struck.body]) return way;
          struck = this.beside(struck.body, side);
        }
        return null;
      });
    return ways.includes(null) ? null : [...ways[0].reverse(), { body: i, feature: null }, ...ways[1]];
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
  // The flat face of a finite wall that a disc struck last.
  face(i, k) {
    const { last, across: opposite } = this.toAndFro[i],
      struck = [last, opposite].find((one) => one?.body === wallBody(k) && one.feature?.kind === "face");
    return struck?.feature ?? null;
  }
  gap(i, k) {
    if (this.bodies.planes[k]) return this.room(i, k);
    const face = this.face(i, k);
    return face && gapOf(this.bodies.mover(i, k), face);
  }
  // Whether a disc is before a wall from now on for some seconds, whichever of the drifts along it it has.
  stays(i, k, [tx, ty], drifts, seconds) {
    if (this.bodies.planes[k]) return true;
    const face = this.face(i, k);
    if (face === null) return false;
    const [x, y, vx, vy] = this.bodies.seenFrom(i, k),
      [ux, uy] = this.bodies.v(i),
      ex = face.b[0] - face.a[0],
      ey = face.b[1] - face.a[1],
      now = (x - face.a[0]) * ex + (y - face.a[1]) * ey,
      way = tx * ex + ty * ey,
      own = (ux - vx) * tx + (uy - vy) * ty;
    return drifts.every(([velocity, pull]) => {
      const rate = (velocity - own) * way,
        bend = pull * way,
        turns = bend ? -rate / bend : 0,
        times = [0, seconds, ...(0 < turns && turns < seconds ? [turns] : [])];
      return times
        .map((t) => now + t * (rate + 0.5 * bend * t))
        .every((along) => 0 <= along && along <= ex * ex + ey * ey);
    });
  }
}
