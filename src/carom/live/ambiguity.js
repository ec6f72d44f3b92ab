// Impacts whose result no physics decides: a run of them in a row is bodies that are pressed together by others.
// carom/solvers/impact_log.py, carom/solvers/impact/resolution.py and `are_decidable` of carom/physics/wall_features.py.
import { INF, min, sqrt } from "./arithmetic.js";
import { sameFeature } from "./features.js";
import { sizeOf, sizesOf, touchingReach } from "./finite.js";
import { dot, over, plus, rational, times } from "./rational.js";

export const ULP = 2 ** -52;
export const gapResolution = (sizes) => 5 * ULP * sizes;
const wallResolution = (sizes, speed) => (speed > 0 ? gapResolution(sizes) / speed : INF);
function pairResolution(sizes, reach, ux, uy, speed) {
  const error = gapResolution(sizes),
    fast = sqrt(ux * ux + uy * uy),
    graze = fast > 0 ? (reach * sqrt(2 * (error / reach))) / fast : INF;
  return speed > 0 ? min(error / speed, graze) : graze;
}
// To how many seconds the instant of an impact just carried out is known.
export function resolutionOf(b, { time_s, first: i, second: j, normal: [nx, ny], before }) {
  const [[ax, ay], [bx, by]] = before,
    speed = (ax - bx) * nx + (ay - by) * ny,
    size = sizeOf(b.x[i], b.y[i], b.radius[i]),
    plane = j < 0 ? b.planes[-1 - j] : null;
  let known;
  if (j >= 0) {
    const sizes = size + sizeOf(b.x[j], b.y[j], b.radius[j]);
    known = pairResolution(sizes, b.radius[i] + b.radius[j], ax - bx, ay - by, speed);
  } else if (plane) known = wallResolution(size + sizeOf(plane[0], plane[1], 0), speed);
  else {
    const { again, feature } = b.lastHit[i],
      sizes = again ? 0 : size + sizesOf(feature);
    if (again) known = 0;
    else if (feature.kind === "face") known = wallResolution(sizes, speed);
    else known = pairResolution(sizes, touchingReach(b.mover(i, -1 - j), feature), ax - bx, ay - by, speed);
  }
  return known + 2 * ULP * time_s;
}

const SQUARES = [1n, 2n, 3n]; // over 4, of the cosines of 60, 45 and 30 degrees
const wayOfFace = ({ along }) => along.map(([high, low]) => plus(rational(high), rational(low)));
function areDecidable(one, other, elastic) {
  if (sameFeature(one, other)) return true;
  if (one.kind !== "face" || other.kind !== "face") return false;
  const [a, b] = [wayOfFace(one), wayOfFace(other)],
    inner = dot(a, b);
  if (inner[0] === 0n) return true;
  const [n, d] = over(times(inner, inner), times(dot(a, a), dot(b, b)));
  return elastic && inner[0] < 0n && SQUARES.some((part) => 4n * n === part * d);
}

const NONE = { latest: -INF, nx: 0, ny: 0, feature: null, elastic: false };
const interferes = (one, begin, next) => {
  if (!(begin <= one.latest && next.nx * one.nx + next.ny * one.ny !== 0)) return false;
  if (one.feature === null || next.feature === null) return true;
  return !areDecidable(one.feature, next.feature, one.elastic && next.elastic);
};
// Whether each impact shares a movable disc with an earlier one at what may be the same instant.
export class Ambiguity {
  constructor(bodies) {
    this.bodies = bodies;
    this.recent = bodies.inverseMass.map((mass) => (mass > 0 ? { furthest: NONE, across: NONE } : null));
  }
  add(record, resolution) {
    const b = this.bodies,
      wall = record.second < 0 ? -1 - record.second : null,
      rubs = wall === null ? b.grip[0] > 0 && b.n > 1 : b.wallGrip[wall][0] > 0,
      [nx, ny] = rubs ? [NaN, NaN] : record.normal;
    const next = {
      latest: record.time_s + resolution,
      nx,
      ny,
      feature: rubs || wall === null || !b.finite[wall] ? null : b.lastHit[record.first].feature,
      elastic: wall !== null && b.wallRestitution[wall] === 1,
    };
    const discs = [record.first, record.second].filter((body) => body >= 0 && this.recent[body]);
    return discs.map((disc) => this.addTo(this.recent[disc], record.time_s - resolution, next)).includes(true);
  }
  addTo(recent, begin, next) {
    const { furthest, across } = recent,
      found = interferes(furthest, begin, next) || interferes(across, begin, next),
      parallel = next.nx * furthest.ny === next.ny * furthest.nx;
    if (next.latest > furthest.latest) {
      if (!parallel) recent.across = furthest;
      recent.furthest = next;
    } else if (!parallel && next.latest > across.latest) recent.across = next;
    return found;
  }
}
