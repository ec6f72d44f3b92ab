// What discs are in contact with: half-planes, and the straight faces of walls that end. carom/solvers/falling/grounds.py.
import { INF, min } from "./arithmetic.js";
import { descentTime, footIsOn, vertexFalling } from "./encounter.js";
import { sameFeature } from "./features.js";
import { wallGap } from "./meeting.js";

const samePoint = (p, q) => p[0] === q[0] && p[1] === q[1];
export class Ground {
  constructor(wall, plane, face = null, never = [], ends = [null, null]) {
    Object.assign(this, { wall, plane, face, never, ends, normal: plane.slice(2) });
  }
  gapOf(b, i) {
    return wallGap(b.x[i], b.y[i], b.radius[i], this.plane)[0];
  }
  place(b, i) {
    const [qx, qy, nx, ny] = this.plane;
    return (b.x[i] - qx) * ny - (b.y[i] - qy) * nx;
  }
  // After how many seconds a disc comes to an end of the face.
  endsAfter(b, i, speed, rate) {
    if (this.face === null) return INF;
    const place = this.place(b, i),
      [length] = this.face.length;
    return min(
      speed < 0 || rate < 0 ? descentTime([place, 0], [speed, 0], [rate, 0]) : INF,
      speed > 0 || rate > 0 ? descentTime([length - place, 0], [-speed, 0], [-rate, 0]) : INF,
    );
  }
  // Sets a disc at the end that it has come to; the vertex there, or null.
  setAtEnd(b, i) {
    const [nx, ny] = this.normal,
      last = 2 * this.place(b, i) > this.face.length[0],
      [x, y] = last ? this.face.b : this.face.a,
      away = b.radius[i] + this.face.halfWidth;
    b.x[i] = x + away * nx;
    b.y[i] = y + away * ny;
    return this.ends[last ? 1 : 0];
  }
  fliesOver(b, i, vertex) {
    return vertexFalling(b.mover(i, this.wall), vertex, b.gravity, 0) > 0;
  }
}
// Whether a feature is of an arc, and ends, or is, at a point.
function arcEnds({ edges: line }, { kind, sector, radius, centre, edges }, at) {
  if (kind !== "arc" || sector === null) return false;
  const ends = radius[0] ? [line[edges[0]].a, line[edges.at(-1)].b] : [centre.map(([high]) => high)];
  return ends.some((end) => samePoint(end, at));
}
// What a disc may be in contact with of a wall, and of a finite one of a feature; null for none.
export function groundOf(b, k, feature = null) {
  if (b.runs(k)) return null;
  if (b.planes[k]) return new Ground(k, b.planes[k]);
  if (feature?.kind !== "face") return null;
  const [nx, ny] = feature.normal,
    h = feature.halfWidth,
    ends = [feature.a, feature.b],
    { features } = b.finite[k],
    over = ends.map((end) => features.find(({ kind, at }) => kind === "vertex" && samePoint(at, end)) ?? null);
  const isSide = (face) => ends.every((end) => samePoint(face.a, end) || samePoint(face.b, end)),
    sides = features.filter((face) => face.kind === "face" && isSide(face)),
    plane = [feature.a[0] + h * nx, feature.a[1] + h * ny, nx, ny];
  // An arc that goes on smoothly is come to where the face ends.
  const smooth = ends.filter((_, n) => over[n] === null),
    onward = features.filter((part) => smooth.some((end) => arcEnds(b.finite[k].outline, part, end)));
  return new Ground(k, plane, feature, [...sides, ...over.filter((vertex) => vertex), ...onward], over);
}
export function* groundsOf(b, i) {
  for (const [k, finite] of b.finite.entries()) {
    const touched = finite
      ? finite.features.filter((part) => part.kind === "face" && footIsOn(b.mover(i, k), part, 0, b.gravity))
      : [null];
    for (const feature of touched) {
      const ground = groundOf(b, k, feature);
      if (ground) yield ground;
    }
  }
}
export const isNeverMet = (never, feature) => never.some((one) => sameFeature(one, feature));
