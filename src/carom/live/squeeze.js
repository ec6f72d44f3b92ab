// Discs that bounce to and fro between two parallel walls that close on them, without end: carom/solvers/plain/squeeze.py.
import { abs, hypot, sqrt } from "./arithmetic.js";
import { wallBody } from "./bodies.js";
import { gapOf } from "./finite.js";

export class Squeezes {
  constructor(bodies, most) {
    this.bodies = bodies;
    this.most = most;
    this.last = bodies.x.map(() => null);
    this.row = bodies.x.map(() => 0);
  }
  // Notes that a disc has struck a wall, or another disc (null); when it is crushed, since the epoch, or Infinity.
  struck(disc, wall) {
    const last = this.last[disc];
    this.last[disc] = null;
    if (wall === null) {
      this.row[disc] = 0;
      return Infinity;
    }
    const normal = this.bodies.normal(disc, wall);
    this.last[disc] = [wall, normal];
    const opposite =
      last !== null && last[0] !== wall && last[1][0] === -normal[0] && last[1][1] === -normal[1];
    this.row[disc] = opposite ? this.row[disc] + 1 : 0;
    return last === null || this.row[disc] <= this.most ? Infinity : this.crushed(disc, wall, last[0]);
  }
  // Nothing else may come near till then, nor may a wall go on to another leg of its path.
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
    const left = gap / closing;
    if (legs.some(({ end }) => end <= now + left) || this.isDisturbed(i, between, gap, left)) return Infinity;
    const bounded = between.filter((wall) => !b.planes[wall]),
      rubs = between.some((wall) => b.wallGrip[wall][0] > 0);
    if ((bounded.length && rubs) || !bounded.every((wall) => this.stays(i, wall, left))) return Infinity;
    return now + left;
  }
  // Whether something else may come to a disc so soon, as all move now.
  isDisturbed(i, between, gap, seconds) {
    const b = this.bodies,
      now = b.time[i],
      [nx, ny] = b.normal(i, between[0]),
      fall = 0.5 * hypot(...b.gravity) * seconds * seconds,
      speedOf = ({ velocity }) => hypot(...velocity),
      fastest = (body) => Math.max(...b.legsAhead(body, now).map(speedOf)),
      sides = between.map((wall) => speedOf(b.legsAhead(wallBody(wall), now)[0])),
      way = gap + fall + seconds * (abs(b.vx[i] * ny - b.vy[i] * nx) + Math.max(...sides));
    for (const k of b.planes.keys())
      if (!between.includes(k) && this.room(i, k) <= way + fastest(wallBody(k)) * seconds) return true;
    for (let j = 0; j < b.n; j++) {
      const [x, y, u, v] = b.stateAt(j, [now, 0]),
        room = hypot(x - b.x[i], y - b.y[i]) - b.radius[i] - b.radius[j];
      if (j !== i && room <= way + fall + Math.max(hypot(u, v), fastest(j)) * seconds) return true;
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
