// Finite walls as the solvers see them: what a disc meets, the normal there, and gaps: carom/solvers/plain/finite_walls.py.
import { abs, sqrt, twoSum } from "./arithmetic.js";
import { KINDS, featuresOf } from "./features.js";
import { excess } from "./meeting.js";
import { Outline } from "./outline.js";
import { faceGap, featureTime, fromPair, reachOfArc } from "./touching.js";

const centreOf = (feature) => (feature.kind === "vertex" ? feature.at.map((x) => [x, 0]) : feature.centre);
const isInside = (feature) => feature.kind === "arc" && feature.inside;
// The unit vector from a feature to a disc that touches it.
function normalAt(feature, disc) {
  if (feature.kind === "face") return feature.normal;
  const centre = centreOf(feature),
    x = fromPair(disc.x, centre[0])[0],
    y = fromPair(disc.y, centre[1])[0],
    sign = isInside(feature) ? -1 : 1,
    distance = sqrt(x * x + y * y);
  return [(sign * x) / distance, (sign * y) / distance];
}
// How far a disc is from the centre of a vertex or arc, and how far where it touches.
function awayFrom(disc, feature) {
  const centre = centreOf(feature),
    x = disc.x[0] - centre[0][0],
    y = disc.y[0] - centre[1][0],
    reach = feature.kind === "vertex" ? disc.radius + feature.halfWidth : reachOfArc(disc, feature)[0];
  return [sqrt(x * x + y * y), reach];
}
export const touchingReach = (disc, feature) => awayFrom(disc, feature)[1];
export function gapOf(disc, feature) {
  if (feature.kind === "face") return faceGap(disc, feature)[0] / feature.length[0];
  const centre = centreOf(feature),
    reach = feature.kind === "vertex" ? twoSum(disc.radius, feature.halfWidth) : reachOfArc(disc, feature),
    [away] = awayFrom(disc, feature),
    gap = excess(fromPair(disc.x, centre[0]), fromPair(disc.y, centre[1]), reach)[0] / (away + reach[0]);
  return isInside(feature) ? -gap : gap;
}
// How the normal turns as a disc moves along a feature, radians a metre.
export function bendOf(feature, disc) {
  if (feature.kind === "face") return 0;
  const [away] = awayFrom(disc, feature);
  return isInside(feature) ? -1 / away : 1 / away;
}
export const sizeOf = (x, y, radius) => abs(x) + abs(y) + radius;
export function sizesOf(feature) {
  if (feature.kind === "face") return sizeOf(...feature.a, feature.halfWidth);
  if (feature.kind === "vertex") return sizeOf(...feature.at, feature.halfWidth);
  return sizeOf(feature.centre[0][0], feature.centre[1][0], feature.radius[0] + feature.halfWidth);
}

export class FiniteWall {
  constructor(wall) {
    this.outline = new Outline(wall);
    this.features = featuresOf(this.outline);
  }
  // When a disc meets it, what of it, and whether it glides there; `last` is the feature that it met last.
  nextTime(disc, last) {
    let least = { time: Infinity, feature: null, glides: false };
    for (const feature of this.features) {
      const { time, glides } = featureTime(disc, feature, feature === last);
      if (time < least.time) least = { time, feature, glides };
    }
    return least;
  }
  hit(disc, feature) {
    const { edges, kind } = feature,
      edge = edges.length === 1 ? edges[0] : this.outline.nearest(disc.x[0], disc.y[0], edges).edge;
    return { feature, normal: normalAt(feature, disc), edge: [edge, KINDS[kind]] };
  }
  // What of it is nearest to a disc's centre, as PIT finds it; null where that is on the wall's line.
  hitFrom(x, y) {
    const { at, edge, inner } = this.outline.nearest(x, y),
      dx = x - at[0],
      dy = y - at[1],
      distance = sqrt(dx * dx + dy * dy);
    if (distance === 0) return null;
    const bent = this.outline.stretches[edge].centre === null ? KINDS.face : KINDS.arc;
    return { feature: null, normal: [dx / distance, dy / distance], edge: [edge, inner ? bent : KINDS.vertex] };
  }
}
