// When a disc in straight flight touches a face, a vertex or an arc: carom/physics/face_time.py and arc_time.py, line by
// line. A disc as a wall sees it is { x, y, ux, uy: pairs, radius }.
import { INF, abs, pairProduct, sqrt, sumOfProducts, twoDiff, twoProd, twoSum } from "./arithmetic.js";
import {
  DOUBTFUL_DISCRIMINANT,
  ERROR,
  NEGLIGIBLE,
  discriminantFromGap,
  discriminantFromMiss,
  exactDiscriminant,
  exactRoot,
  excess,
  innerProduct,
  meetingTime,
  products,
  quotient,
  square,
} from "./meeting.js";

const DOUBTFUL_GAP = 2 ** -44,
  PAIR_ERROR = 2 ** -100;
const opposite = ([high, low]) => [-high, -low];
export const fromPoint = (a, q) => {
  const [high, low] = twoDiff(a[0], q);
  return twoSum(high, low + a[1]);
};
export const fromPair = (a, q) => {
  const [high, low] = twoDiff(a[0], q[0]);
  return twoSum(high, low + (a[1] - q[1]));
};
export const across = (ex, ey, x, y) => innerProduct(ex, opposite(ey), y, x);

// --- faces ---
const pairQuotient = (a, b) => {
  const first = a[0] / b[0],
    [product, rest] = twoProd(first, b[0]);
  return twoSum(first, (a[0] - product - rest + (a[1] - first * b[1])) / b[0]);
};
// By how far a rim is from a face's line, times the face's length.
export function faceGap(disc, { a, along: [ex, ey], length, halfWidth }) {
  const x = fromPoint(disc.x, a[0]),
    y = fromPoint(disc.y, a[1]),
    reach = twoSum(disc.radius, halfWidth);
  const gap = sumOfProducts([...products(ex, y), ...products(opposite(ey), x), ...products(opposite(length), reach)]);
  if (abs(gap[0]) > DOUBTFUL_GAP * (length[0] * reach[0])) return gap;
  const squares = opposite(exactDiscriminant(x, y, ex, ey, reach)),
    passed = across(ex, ey, x, y),
    root = pairProduct(length, reach),
    [high, low] = twoSum(passed[0], root[0]);
  return pairQuotient(squares, [high, low + (passed[1] + root[1])]);
}
export function isBeforeFace(disc, { a, b, along: [ex, ey] }) {
  const x = fromPoint(disc.x, a[0]),
    y = fromPoint(disc.y, a[1]);
  return (
    across(ex, ey, x, y)[0] > 0 &&
    innerProduct(ex, ey, x, y)[0] >= 0 &&
    innerProduct(ex, ey, fromPoint(disc.x, b[0]), fromPoint(disc.y, b[1]))[0] <= 0
  );
}
export function faceTime(disc, face) {
  const [ex, ey] = face.along,
    { ux, uy } = disc,
    toward = ex[0] * uy[0] - ey[0] * ux[0];
  if (toward > ERROR * (abs(ex[0] * uy[0]) + abs(ey[0] * ux[0])) + NEGLIGIBLE) return INF;
  const speed = across(ex, ey, ux, uy);
  if (!(speed[0] < 0)) return INF;
  const gap = faceGap(disc, face);
  if (gap[0] <= 0) return isBeforeFace(disc, face) ? 0 : INF;
  return comesOnto(disc, face) ? quotient(gap, speed) : INF;
}
function comesOnto(disc, { a, b, along: [ex, ey], length, halfWidth }) {
  const { ux, uy } = disc,
    drift = products(twoSum(disc.radius, halfWidth), innerProduct(ex, ey, ux, uy)),
    past = (end) =>
      sumOfProducts([
        ...products(length, across(fromPoint(disc.x, end[0]), fromPoint(disc.y, end[1]), ux, uy)),
        ...drift,
      ])[0];
  return past(a) <= 0 && 0 <= past(b);
}

// --- vertices and arcs ---
export function reachOfArc(disc, arc) {
  const thick = twoSum(disc.radius, arc.halfWidth),
    own = arc.inside ? opposite(thick) : thick,
    [high, low] = twoSum(arc.radius[0], own[0]);
  return twoSum(high, low + (arc.radius[1] + own[1]));
}
// The cross product of an end's direction and a place, and what rounding leaves open of it.
function turnTo([fx, fy], x, y, movedX, movedY) {
  const moved = abs(fx[0] * movedY) + abs(fy[0] * movedX),
    placed = abs(fx[0] * y[0]) + abs(fy[0] * x[0]);
  return [across(fx, fy, x, y)[0], ERROR * moved + PAIR_ERROR * placed + NEGLIGIBLE];
}
export function isIn(sector, x, y, movedX = 0, movedY = 0) {
  if (sector === null) return true;
  const [afterFirst, firstOpen] = turnTo(sector.first, x, y, movedX, movedY),
    [afterLast, lastOpen] = turnTo(sector.last, x, y, movedX, movedY);
  const begun = afterFirst >= -firstOpen,
    notEnded = afterLast <= lastOpen;
  return sector.reflex ? begun || notEnded : begun && notEnded;
}
export function isBeforeArc(disc, arc) {
  const x = fromPair(disc.x, arc.centre[0]),
    y = fromPair(disc.y, arc.centre[1]),
    beyond = excess(x, y, arc.radius)[0];
  return (arc.inside ? beyond < 0 : beyond > 0) && isIn(arc.sector, x, y);
}
const vertexTime = (disc, { at, halfWidth }) =>
  meetingTime([
    fromPair(disc.x, [at[0], 0]),
    fromPair(disc.y, [at[1], 0]),
    disc.ux,
    disc.uy,
    twoSum(disc.radius, halfWidth),
  ]);
function outerArcTime(disc, arc) {
  if (disc.radius < arc.fitsBelow) return INF;
  const x = fromPair(disc.x, arc.centre[0]),
    y = fromPair(disc.y, arc.centre[1]),
    time = meetingTime([x, y, disc.ux, disc.uy, reachOfArc(disc, arc)]);
  if (time === INF) return time;
  if (time === 0) return isBeforeArc(disc, arc) ? time : INF;
  return touches(arc.sector, x, y, disc, time) ? time : INF;
}
const never = { time: INF, glides: false };
function innerArcTime(disc, arc, justLeft) {
  const reach = reachOfArc(disc, arc),
    a = sumOfProducts([...square(disc.ux), ...square(disc.uy)]);
  if (!(disc.radius < arc.fitsBelow) || a[0] === 0) return never;
  const x = fromPair(disc.x, arc.centre[0]),
    y = fromPair(disc.y, arc.centre[1]),
    b = innerProduct(x, y, disc.ux, disc.uy),
    c = justLeft ? [0, 0] : excess(x, y, reach);
  let { time, glides } = never;
  if (c[0] === 0 && b[0] < 0) {
    const chord = quotient([2 * b[0], 2 * b[1]], a);
    if (chord * (abs(disc.ux[0]) + abs(disc.uy[0])) > 2 * ERROR * reach[0]) time = chord;
  } else if (c[0] < 0 || b[0] < 0) [time, glides] = laterRoot(x, y, disc, reach, a, b, c);
  if (time < INF && touches(arc.sector, x, y, disc, time, glides)) return { time, glides };
  const staysOut = b[0] < 0 && time === INF;
  if (c[0] >= 0 && (staysOut || b[0] >= 0) && (justLeft || isBeforeArc(disc, arc))) {
    glides = staysOut || justLeft || b[0] === 0;
    if (!glides || touches(arc.sector, x, y, disc, 0, true)) return { time: 0, glides };
  }
  return staysOut && arc.sector !== null ? comingIn(arc, x, y, disc, reach) : never;
}
// When a disc that stays out of the circle comes into the sector where it overlaps the arc.
function comingIn({ sector, radius }, x, y, { ux, uy }, reach) {
  let first = INF;
  for (const [[fx, fy], sense] of [
    [sector.first, 1],
    [sector.last, -1],
  ]) {
    const turn = across(fx, fy, x, y),
      rate = across(fx, fy, ux, uy);
    if (!(sense * turn[0] < 0 && 0 < sense * rate[0])) continue;
    const time = quotient(turn, rate),
      [px] = wayOf(x, ux, time),
      [py] = wayOf(y, uy, time),
      isAhead = fx[0] * px[0] + fy[0] * py[0] > 0;
    if (time < first && isAhead && excess(px, py, reach)[0] > 0 && 0 > excess(px, py, radius)[0]) first = time;
  }
  return { time: first, glides: first < INF };
}
// The later root, and whether it is the earlier one, too.
function laterRoot(x, y, disc, reach, a, b, c) {
  const b2 = b[0] * b[0],
    largest = a[0] * (reach[0] * reach[0]),
    near = c[0] < 0 || b2 < largest;
  let d = near ? discriminantFromGap(b, c, a) : discriminantFromMiss(x, y, disc.ux, disc.uy, reach, a);
  if (c[0] > 0 && abs(d[0]) <= DOUBTFUL_DISCRIMINANT * (near ? b2 : largest))
    d = exactDiscriminant(x, y, disc.ux, disc.uy, reach);
  if (d[0] === 0) return [quotient(b, a), true];
  if (d[0] < 0) return [INF, false];
  const root = sqrt(d[0]);
  if (b[0] > 0) return [exactRoot(opposite(b), opposite(c), d, root), false];
  const [product, productRest] = twoProd(root, root),
    rootRest = (d[0] - product - productRest + d[1]) / (2 * root),
    [high, low] = twoSum(root, -b[0]);
  return [-quotient([high, low + (rootRest - b[1])], a), false];
}
const wayOf = (x, u, time) => {
  const [way, rest] = twoProd(time, u[0]),
    [high, low] = twoSum(x[0], way);
  return [twoSum(high, low + (x[1] + (rest + time * u[1]))), way];
};
// Whether a disc at (x, y) from the centre is in the sector at a time; one that glides, not where it is left.
function touches(sector, x, y, disc, time, glides = false) {
  if (sector === null) return true;
  const [px, movedX] = wayOf(x, disc.ux, time),
    [py, movedY] = wayOf(y, disc.uy, time);
  if (glides) {
    const end = px[0] * disc.uy[0] - py[0] * disc.ux[0] > 0 ? sector.last : sector.first,
      [turn, open] = turnTo(end, px, py, movedX, movedY);
    if (abs(turn) <= open && end[0][0] * px[0] + end[1][0] * py[0] > 0) return false;
  }
  return isIn(sector, px, py, movedX, movedY);
}

// A straight path does not come back to what it has just left, except to an arc from inside.
export function featureTime(disc, feature, justLeft) {
  if (feature.kind === "arc" && feature.inside) return innerArcTime(disc, feature, justLeft);
  if (justLeft) return never;
  const time = { face: faceTime, vertex: vertexTime, arc: outerArcTime }[feature.kind](disc, feature);
  return { time, glides: false };
}
