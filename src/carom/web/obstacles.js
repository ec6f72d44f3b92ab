// Builds the rows of numbers that describe walls and driven bodies for the core, as carom/core/input_rows.py and
// carom/solvers/event_driven/obstacles.py do.
import { isDriven, legsOf } from "./prescribed_motion.js";
import { featuresOf, sameFeature } from "./features.js";
import { Outline } from "./chain_geometry.js";
import { dot, over, plus, rational, times } from "./rational.js";

export const wallBody = (k) => -1 - k;
const [PLANE, FACE, VERTEX, OUTER_ARC, INNER_ARC] = [0, 1, 2, 3, 4];
const PAIRS = 7; // number of pairs of numbers in a row
const exact = (x) => [x, 0];

function row(kind, wall, feature, normal, pairs) {
  const { whole = false, reflex = false, halfWidth = 0, fitsBelow = 0 } = feature;
  const filled = [...pairs, ...Array(PAIRS - pairs.length).fill([0, 0])];
  return [kind, wall, Number(whole), Number(reflex), halfWidth, fitsBelow, ...normal, ...filled.flat()];
}
function rowOf(feature, wall) {
  const { kind, halfWidth } = feature;
  if (kind === "face") {
    const [start, end] = [feature.a, feature.b].map((point) => point.map(exact));
    return row(FACE, wall, { halfWidth }, feature.normal, [...start, feature.length, ...feature.along, ...end]);
  }
  if (kind === "vertex") return row(VERTEX, wall, { halfWidth, whole: true }, [0, 0], feature.at.map(exact));
  const { centre, radius, inside, sector, fitsBelow } = feature,
    shape = { halfWidth, fitsBelow, whole: sector === null, reflex: sector?.reflex };
  return row(radius[0] === 0 ? VERTEX : inside ? INNER_ARC : OUTER_ARC, wall, shape, [0, 0], [
    ...centre,
    radius,
    ...(sector ? [...sector.first, ...sector.last] : []),
  ]);
}

const SQUARES = [1n, 2n, 3n]; // squared cosines of 60, 45 and 30 degrees, times 4
const wayOf = ({ along }) => along.map(([high, low]) => plus(rational(high), rational(low)));
// Returns whether the impacts of a disc on two features at one instant have the same result in both orders. This
// function equals `are_decidable` of carom/core/wall_parts.py.
function areOrderFree(one, other, elastic) {
  if (sameFeature(one, other)) return true;
  if (one.kind !== "face" || other.kind !== "face") return false;
  const [a, b] = [wayOf(one), wayOf(other)],
    inner = dot(a, b);
  if (inner[0] === 0n) return true;
  const [n, d] = over(times(inner, inner), times(dot(a, a), dot(b, b)));
  return elastic && inner[0] < 0n && SQUARES.some((part) => 4n * n === part * d);
}

// Rows for the walls of a scene: one row per half-plane, and one row per feature of a finite wall. Features that the
// discs of the scene can't hit because of their radii are omitted.
export class Obstacles {
  constructor(walls, widest) {
    this.walls = walls;
    this.outlines = walls.map((wall) => (wall.normal ? null : new Outline(wall)));
    this.features = []; // features of finite walls, by the number of the row
    this.rows = [];
    walls.forEach((wall, k) => {
      if (wall.normal) {
        const [x, y] = wall.point_m;
        this.rows.push(row(PLANE, k, {}, wall.normal, [exact(x), exact(y)]));
        return;
      }
      for (const feature of featuresOf(this.outlines[k], widest)) {
        this.features[this.rows.length] = feature;
        this.rows.push(rowOf(feature, k));
      }
    });
  }
  isOrderFree(one, other, elastic) {
    return areOrderFree(this.features[one], this.features[other], elastic);
  }
  // Returns two arrays. The first array has four numbers for each row: whether a disc can stay in contact with the
  // row's feature, the vertices at the feature's two ends (-1 for none), and a count. The count is the number of
  // features that a disc in contact with the row's feature can't hit. The second array lists the features that discs in
  // contact can't hit, row after row.
  grounds() {
    const never = [],
      rows = this.rows.map(([, wall], number) => {
        const feature = this.features[number],
          { surface_speed_m_s = 0 } = this.walls[wall];
        if (surface_speed_m_s || isDriven(legsOf(this.walls[wall]))) return [0, -1, -1, 0];
        if (!feature) return [1, -1, -1, 0];
        if (feature.kind !== "face") return [0, -1, -1, 0];
        const [over, list] = this.around(feature, wall);
        never.push(...list);
        return [1, ...over, list.length];
      });
    return [rows, never];
  }
  // Returns the vertices at the ends of a face, and the features that a disc in contact with the face can't hit: the
  // face and its other side, the vertices, and arcs that continue the wall smoothly.
  around(face, wall) {
    const numbers = [...this.features.keys()].filter((n) => this.features[n] && this.rows[n][1] === wall),
      all = (fits) => numbers.filter((n) => fits(this.features[n])),
      ends = [face.a, face.b],
      over = ends.map((end) => all(({ kind, at }) => kind === "vertex" && samePoint(at, end))[0] ?? -1);
    const sides = all(({ kind, a, b }) => kind === "face" && [a, b].every((end) => ends.some((one) => samePoint(one, end))));
    const beyond = ends.map((end, n) =>
      over[n] < 0 ? all((feature) => endsAt(this.outlines[wall], feature, end)) : [over[n]],
    );
    return [over, [...sides, ...beyond.flat()]];
  }
}
const samePoint = (p, q) => p[0] === q[0] && p[1] === q[1];
// Whether a feature is an arc that ends at a point. An arc of radius 0 ends at its centre. A whole circle has no ends.
function endsAt({ edges: line }, { kind, sector, radius, centre, edges }, at) {
  if (kind !== "arc" || sector === null) return false;
  const ends = radius[0] ? [line[edges[0]].a, line[edges.at(-1)].b] : [centre.map(([high]) => high)];
  return ends.some((end) => samePoint(end, at));
}

// Returns the rows of driven bodies (walls first), and the rows of the legs of their paths.
export function drivenRows({ discs, walls }) {
  const bodies = [
      ...walls.map((wall, k) => [wallBody(k), wall, wall.surface_speed_m_s ?? 0]),
      ...discs.map((disc, i) => [i, disc, 0]).filter(([, disc]) => disc.driven),
    ],
    rows = [],
    legs = [];
  for (const [body, moving, belt] of bodies) {
    const own = legsOf(moving),
      path = isDriven(own) ? own : [];
    if (path.length || belt) rows.push([body, path.length, belt]);
    legs.push(...path.map(({ begin, end, moved, velocity }) => [begin, end, ...moved, ...velocity]));
  }
  return [rows, legs];
}
// Returns the rows of walls for PIT, and the rows of the edges of these walls. A half-plane has no edges.
export function chainRows({ walls, outlines }) {
  const edges = [],
    rows = outlines.map((outline, k) => {
      if (outline === null) return [0, 0, 0, ...walls[k].point_m, ...walls[k].normal];
      for (const { edge, centre, radius } of outline.stretches) {
        const isWhole = samePoint(edge.a, edge.b),
          [x, y] = centre ?? [0, 0];
        edges.push([...edge.a, ...edge.b, edge.bulge, x, y, radius, Number(centre !== null), Number(isWhole)]);
      }
      const size = lengthsOf(outline).reduce((sum, length) => sum + Math.abs(length), 0);
      return [outline.stretches.length, outline.halfWidth, size, 0, 0, 0, 0];
    });
  return [rows, edges];
}
// Returns the coordinates and radii of a finite wall.
export const lengthsOf = ({ points, halfWidth, stretches }) => [
  ...points.flat(),
  halfWidth,
  ...stretches.flatMap(({ centre, radius }) => (centre === null ? [] : [...centre, radius])),
];
