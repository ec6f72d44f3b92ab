// Outline of a finite wall in floats, and the point of the outline that is nearest to a position, as in
// carom/model/chain_geometry.py.
import { ldexp } from "./arithmetic.js";
import { halfBits, less, nearest, over, plus, power4, rational, times } from "./rational.js";

const HALF = [1n, 2n];
export const sameEnds = ({ a, b }) => a[0] === b[0] && a[1] === b[1];
// Returns the exact circle of an edge whose bulge is not 0.
export function circleOf({ a, b, bulge }) {
  const [ax, ay, bx, by, k] = [...a, ...b, bulge].map(rational),
    across = over(less([1n, 1n], times(k, k)), times([4n, 1n], k));
  const x = less(times(plus(ax, bx), HALF), times(across, less(by, ay))),
    y = plus(times(plus(ay, by), HALF), times(across, less(bx, ax))),
    [dx, dy] = [less(ax, x), less(ay, y)];
  return { x, y, radius2: plus(times(dx, dx), times(dy, dy)) };
}
const floatRoot = (square) => {
  const shift = halfBits(square);
  return ldexp(Math.sqrt(nearest(over(square, power4(shift)))), shift);
};
const squareOf = (x, y) => x * x + y * y;

// An edge or a whole circle.
class Stretch {
  constructor(edge, centre = null, radius = 0) {
    Object.assign(this, { edge, centre, radius });
  }
  static of(edge) {
    if (edge.bulge === 0) return new Stretch(edge);
    const circle = circleOf(edge);
    return new Stretch(edge, [nearest(circle.x), nearest(circle.y)], floatRoot(circle.radius2));
  }
  // Returns the nearest point to a position, and whether it is between the ends.
  nearest(x, y) {
    const {
      a: [ax, ay],
      b: [bx, by],
      bulge,
    } = this.edge;
    if (this.centre === null) {
      const ex = bx - ax,
        ey = by - ay,
        part = ((x - ax) * ex + (y - ay) * ey) / (ex * ex + ey * ey);
      if (0 < part && part < 1) return [[ax + part * ex, ay + part * ey], true];
      return [part <= 0 ? [ax, ay] : [bx, by], false];
    }
    const [cx, cy] = this.centre,
      dx = x - cx,
      dy = y - cy,
      distance = Math.sqrt(dx * dx + dy * dy);
    if (sameEnds(this.edge)) {
      const { radius } = this;
      return [distance ? [cx + (radius * dx) / distance, cy + (radius * dy) / distance] : [ax, ay], radius > 0];
    }
    const begun = ((ax - cx) * (y - ay) - (ay - cy) * (x - ax)) * bulge > 0,
      going = ((bx - cx) * (y - by) - (by - cy) * (x - bx)) * bulge < 0;
    if (Math.abs(bulge) > 1 ? begun || going : begun && going) {
      const out = distance ? this.power(x, y) / (distance + this.radius) : 0;
      return [distance ? [x - (out * dx) / distance, y - (out * dy) / distance] : [ax, ay], true];
    }
    return [squareOf(x - ax, y - ay) <= squareOf(x - bx, y - by) ? [ax, ay] : [bx, by], false];
  }
  power(x, y) {
    const {
        a: [ax, ay],
        b: [bx, by],
        bulge,
      } = this.edge,
      across = (bx - ax) * (y - ay) - (by - ay) * (x - ax);
    return (x - ax) * (x - bx) + (y - ay) * (y - by) - across * (0.5 * (1 / bulge - bulge));
  }
  // Whether a point is between an arc and the straight line that connects the arc's ends.
  bulgesOver(x, y) {
    if (this.centre === null) return false;
    const {
      a: [ax, ay],
      b: [bx, by],
      bulge,
    } = this.edge;
    return this.power(x, y) < 0 && ((bx - ax) * (y - ay) - (by - ay) * (x - ax)) * bulge < 0;
  }
}

export class Outline {
  // Creates the outline of a finite wall.
  constructor({ points_m, bulges = [], closed = false, centre_m, radius_m, half_width_m = 0 }) {
    this.halfWidth = half_width_m;
    this.closed = closed;
    this.radius = points_m ? null : radius_m;
    this.points = points_m ?? [centre_m];
    const ends = closed ? [...this.points.slice(1), this.points[0]] : this.points.slice(1);
    this.edges = points_m ? ends.map((b, k) => ({ a: points_m[k], b, bulge: bulges[k] ?? 0 })) : [];
    const start = points_m ? null : [centre_m[0] + radius_m, centre_m[1]];
    this.stretches = points_m
      ? this.edges.map(Stretch.of)
      : [new Stretch({ a: start, b: start, bulge: 1 }, centre_m, radius_m)];
  }
  // Returns the nearest point on the given edges. If several are equally near, a point between the ends of its edge has
  // precedence, because near a joint rounding hides that this point is nearer than the joint. Then the edge with the
  // lowest number has precedence.
  nearest(x, y, among = this.stretches.keys()) {
    let least = Infinity,
      found;
    for (const edge of among) {
      const [at, inner] = this.stretches[edge].nearest(x, y),
        square = squareOf(at[0] - x, at[1] - y);
      if (square < least || (square === least && inner && !found.inner)) [least, found] = [square, { at, edge, inner }];
    }
    return found;
  }
  // Whether a point that is not on the outline is inside of a closed outline.
  encloses(x, y) {
    let crossings = 0;
    for (const stretch of this.stretches) {
      const {
        a: [ax, ay],
        b: [bx, by],
      } = stretch.edge;
      crossings += stretch.bulgesOver(x, y);
      if (ay > y !== by > y) crossings += ((bx - ax) * (y - ay)) / (by - ay) > x - ax;
    }
    return this.closed && crossings % 2 === 1;
  }
}
