// Computes the features of a finite wall, which are the faces, arcs and vertices that a disc can hit, as in
// carom/core/wall_features.py. Edges on one line or circle are merged. Exact arithmetic decides which edges are merged.
// A feature has a kind (face, vertex or arc) and its edges. A pair of floats [high, low] represents their sum.
import { twoDiff } from "./arithmetic.js";
import { circleOf, sameEnds } from "./chain_geometry.js";
import { alike, cross, dot, less, nearestRoot, negated, pairOf, plus, rational, rootOf, times } from "./rational.js";

// Two features are equal if their geometry is equal, even if they belong to different walls.
const shapeOf = (feature) => JSON.stringify({ ...feature, edges: null });
export const sameFeature = (one, other) => one === other || shapeOf(one) === shapeOf(other);
const exactly = (point) => point.map(rational);

function faceBetween(a, b, halfWidth, edges) {
  const along = [twoDiff(b[0], a[0]), twoDiff(b[1], a[1])],
    [ex, ey] = along.map(([high, low]) => plus(rational(high), rational(low))),
    length2 = plus(times(ex, ex), times(ey, ey));
  const normal = [nearestRoot(negated(ey), length2), nearestRoot(ex, length2)];
  return { kind: "face", edges, a, b, halfWidth, along, length: rootOf(length2), normal };
}
function arcOn({ x, y, radius2 }, ends, halfWidth, inside, edges) {
  const out = ends?.map(([px, py]) => [less(rational(px), x), less(rational(py), y)]),
    sector = out ? { first: out[0].map(pairOf), last: out[1].map(pairOf), reflex: cross(...out)[0] < 0n } : null;
  return roundOf([pairOf(x), pairOf(y)], rootOf(radius2), halfWidth, inside, sector, edges);
}
const PLACES = 2 ** -50;
// A disc with a radius of fitsBelow or more is too large to touch the inner side of an arc, and hits the arc's ends
// instead.
function roundOf(centre, radius, halfWidth, inside, sector, edges) {
  const size = Math.abs(centre[0][0]) + Math.abs(centre[1][0]) + radius[0],
    fitsBelow = inside ? radius[0] - halfWidth - PLACES * size : 0;
  return { kind: "arc", edges, centre, radius, halfWidth, inside, sector, fitsBelow };
}
function stopOf(inner, { x, y }, [dx, dy]) {
  const [left, right] = [[negated(dy), dx], [dy, negated(dx)]].map((way) => way.map(pairOf)),
    sector = { first: left, last: right, reflex: false },
    centre = [pairOf(plus(x, dx)), pairOf(plus(y, dy))];
  return { ...inner, centre, radius: [0, 0], inside: false, sector };
}
const turnOf = ({ bulge }) => (bulge > 0) - (bulge < 0);
const sameCircle = (one, other) =>
  one === null || other === null ? one === other : ["x", "y", "radius2"].every((name) => alike(one[name], other[name]));
// Returns the direction of merged edges at one of their two ends.
function tangent({ edge, circle }, point) {
  if (circle === null) {
    const [a, b] = [exactly(edge.a), exactly(edge.b)];
    return [less(b[0], a[0]), less(b[1], a[1])];
  }
  const [x, y] = exactly(point),
    turn = [BigInt(turnOf(edge)), 1n];
  return [times(turn, less(circle.y, y)), times(turn, less(x, circle.x))];
}
function goesSmoothly(one, other) {
  const a = tangent(one, one.edge.b),
    b = tangent(other, other.edge.a);
  return cross(a, b)[0] === 0n && dot(a, b)[0] > 0n;
}
const goesOnAs = (one, other) =>
  sameCircle(one.circle, other.circle) && turnOf(one.edge) === turnOf(other.edge) && goesSmoothly(one, other);
const joined = (one, other) => ({
  edge: { ...one.edge, b: other.edge.b },
  circle: one.circle,
  numbers: [...one.numbers, ...other.numbers],
});
// Returns the edges of a chain in order. Edges on one line or circle are merged.
function runsOf({ edges, closed, radius, points, stretches }) {
  if (radius !== null) {
    const [x, y] = exactly(points[0]),
      circle = { x, y, radius2: times(rational(radius), rational(radius)) };
    return [{ edge: stretches[0].edge, circle, numbers: [0] }];
  }
  const runs = [];
  edges.forEach((edge, number) => {
    const run = { edge, circle: edge.bulge ? circleOf(edge) : null, numbers: [number] };
    if (runs.length && goesOnAs(runs.at(-1), run)) runs.push(joined(runs.pop(), run));
    else runs.push(run);
  });
  if (closed && runs.length > 1 && goesOnAs(runs.at(-1), runs[0])) {
    const last = runs.pop();
    runs[0] = joined(last, runs[0]);
  }
  return runs;
}
// Returns the left side and the right side of merged edges.
function sidesOf({ edge, circle, numbers }, halfWidth) {
  const { a, b } = edge;
  if (circle === null) return [faceBetween(a, b, halfWidth, numbers), faceBetween(b, a, halfWidth, numbers)];
  const turnsLeft = turnOf(edge) > 0,
    ends = sameEnds(edge) ? null : turnsLeft ? [a, b] : [b, a];
  return [turnsLeft, !turnsLeft].map((inside) => arcOn(circle, ends, halfWidth, inside, numbers));
}
const quartersOf = ([x, y]) => [
  [x, y],
  [negated(y), x],
  [negated(x), negated(y)],
  [y, negated(x)],
];
const NEARLY_HALF = [1n, 1n << 20n];
// Returns the features that discs hit if they are too large to touch the inner side of an arc.
function stopsOf({ edge, circle }, inner, before, after) {
  const [first, last] = [edge.a, edge.b].map((point) => {
      const [x, y] = exactly(point);
      return [less(x, circle.x), less(y, circle.y)];
    }),
    run = turnOf(edge),
    turn = times([BigInt(run), 1n], cross(first, last));
  let ways;
  if (sameEnds(edge)) ways = quartersOf(first);
  else if (less(turn, times(circle.radius2, NEARLY_HALF))[0] > 0n)
    ways = [first, last].filter((_, k) => (k ? after : before));
  else {
    ways = [quartersOf(first).at(run)];
    if (turn[0] !== 0n) ways.push(quartersOf(last).at(-run));
  }
  return ways.map((way) => stopOf(inner, circle, way));
}
// Returns the features of a wall for discs with a radius of at most `widest`.
export function featuresOf(outline, widest) {
  const { halfWidth, closed, radius, points } = outline,
    whole = radius !== null,
    vertex = (at, edge) => ({ kind: "vertex", edges: [edge], at, halfWidth });
  if (radius === 0) return [vertex(points[0], 0)];
  const runs = runsOf(outline),
    ends = [];
  if (!closed && !whole) ends.push(vertex(runs[0].edge.a, runs[0].numbers[0]));
  runs.forEach((before, k) => {
    const next = runs[k + 1] ?? (closed ? runs[0] : null);
    if (next !== null && !sameEnds(before.edge) && !goesSmoothly(before, next))
      ends.push(vertex(next.edge.a, Math.min(before.numbers.at(-1), next.numbers[0])));
  });
  if (!closed && !whole) ends.push(vertex(runs.at(-1).edge.b, runs.at(-1).numbers.at(-1)));
  const sides = runs.map((run) => sidesOf(run, halfWidth)),
    smooth = runs.map((run, k) => (closed || k > 0) && goesSmoothly(runs.at(k - 1), run)),
    stops = runs.flatMap((run, k) => {
      const inner = sides[k].find(({ inside }) => inside);
      if (!inner || inner.fitsBelow > widest) return [];
      return stopsOf(run, inner, smooth[k], smooth[k + 1] ?? (closed && smooth[0]));
    });
  return [...sides.flat(), ...ends, ...stops];
}
