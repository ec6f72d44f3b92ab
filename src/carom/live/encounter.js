// When a falling disc meets a half-plane, a fixed disc, or a feature of a wall: carom/physics/*_falling.py.
import { INF, abs, ldexp, pairProduct, sqrt, twoSum } from "./arithmetic.js";
import { discriminantFromGap, exactRoot, quotient } from "./meeting.js";
import { frac, gcd } from "./rational.js";
import { across, faceGap, fromPair, fromPoint, isBeforeArc, isBeforeFace, isIn, reachOfArc } from "./touching.js";

export const returnTime = (speed, pull) => quotient([2 * speed[0], 2 * speed[1]], pull);
export function descentTime(gap, speed, pull) {
  const w = gap[0],
    s = speed[0],
    a = pull[0];
  if (w <= 0) {
    if (s < 0) return 0;
    if (!(a < 0)) return INF;
    if (s === 0) return 0;
    if (w === 0) return returnTime(speed, pull);
  } else if (a === 0) return s < 0 ? quotient(gap, speed) : INF;
  else if (a > 0 && !(s < 0)) return INF;
  const twice = [2 * gap[0], 2 * gap[1]],
    d = discriminantFromGap(speed, twice, pull);
  if (!(d[0] > 0)) return a > 0 ? INF : quotient(speed, pull);
  const root = sqrt(d[0]);
  if (w > 0 && !(s > 0)) return exactRoot(speed, twice, d, root);
  const [sq, sqRest] = pairProduct([root, 0], [root, 0]),
    [high, low] = twoSum(s, root);
  return quotient([high, low + (speed[1] + (d[0] - sq - sqRest + d[1]) / (2 * root))], pull);
}

// Numbers n / 2^e.
const F = {
  add: ([a, e], [b, f]) => (e >= f ? [a + (b << BigInt(e - f)), e] : [(a << BigInt(f - e)) + b, f]),
  mul: ([a, e], [b, f]) => [a * b, e + f],
  neg: ([a, e]) => [-a, e],
};
const sum = (...terms) => terms.reduce(F.add);
const whole = ([high, low]) => F.add(frac(high), frac(low)); // a pair
const NOTHING = [0n, 0];
// The squared distance from the origin less that of reach, in powers of time; `leaving` where the two have just touched.
function squaredGap([px, py], [ux, uy], [ax, ay], reach, leaving) {
  const two = [2n, 0],
    [q, qe] = sum(F.mul(ax, ax), F.mul(ay, ay));
  const [gap, opening] =
    leaving === null
      ? [
          sum(F.mul(px, px), F.mul(py, py), F.neg(F.mul(reach, reach))),
          F.mul(two, sum(F.mul(px, ux), F.mul(py, uy))),
        ]
      : [NOTHING, F.mul(two, F.mul(reach, frac(leaving)))];
  return [
    gap,
    opening,
    sum(F.mul(ux, ux), F.mul(uy, uy), F.mul(px, ax), F.mul(py, ay)),
    sum(F.mul(ux, ax), F.mul(uy, ay)),
    [q, qe + 2],
  ];
}
// The instants from now on at which a gap closes; 0 where it is closed and does not open.
function* closings(gap) {
  const powers = [...gap];
  while (powers.length && powers[0][0] === 0n) powers.shift();
  if (!powers.length) return;
  if (powers[0][0] < 0n && powers.length < gap.length) yield 0;
  const most = Math.max(...powers.map(([, e]) => e));
  yield* fallsBelowZero(powers.map(([a, e]) => a << BigInt(most - e)));
}
const soonestOf = (times, fits = () => true) => {
  for (const time of times) if (fits(time)) return time;
  return INF;
};
const closed = (gap) => (gap[0][0] <= 0n ? [NOTHING, ...gap.slice(1)] : gap);
export function encounterTime(disc, fixed, gravity, leaving = null) {
  const [x, y, ux, uy, radius, fx, fy, fr, ax, ay] = [...disc, ...fixed, ...gravity].map(frac),
    place = [F.add(x, F.neg(fx)), F.add(y, F.neg(fy))];
  return soonestOf(closings(closed(squaredGap(place, [ux, uy], [ax, ay], F.add(radius, fr), leaving))));
}

// --- features of walls ---
function gapFrom(disc, centre, reach, gravity, leaving) {
  const place = [disc.x, disc.y].map((x, k) => F.add(whole(x), F.neg(whole(centre[k]))));
  return squaredGap(place, [whole(disc.ux), whole(disc.uy)], gravity.map(frac), whole(reach), leaving);
}
export function vertexFalling(disc, { at, halfWidth }, gravity, leaving) {
  const centre = at.map((x) => [x, 0]);
  return soonestOf(closings(closed(gapFrom(disc, centre, twoSum(disc.radius, halfWidth), gravity, leaving))));
}
function arcFalling(disc, arc, gravity, leaving) {
  if (disc.radius < arc.fitsBelow !== arc.inside) return INF;
  const reach = reachOfArc(disc, arc);
  let gap = gapFrom(disc, arc.centre, reach, gravity, leaving);
  if (arc.inside) gap = gap.map((power, k) => (k === 1 && leaving !== null ? power : F.neg(power)));
  if (gap[0][0] <= 0n && isBeforeArc(disc, arc)) gap = closed(gap);
  const inSector = (time) => isInSectorAt(time, disc, arc, gravity),
    found = soonestOf(closings(gap), inSector);
  if (!arc.inside || arc.sector === null || gap[0][0] > 0n) return found;
  return Math.min(found, fallingIn(disc, arc, gravity, gap, inSector));
}
// When a disc touches an arc into whose sector it comes where it touches or overlaps it by then: there the gap is 0.
function fallingIn(disc, { centre, radius, sector }, gravity, gap, inSector) {
  const paths = [disc.x, disc.y].map((x, k) => {
    const [a, e] = frac(gravity[k]);
    return [F.add(whole(x), F.neg(whole(centre[k]))), whole([disc.ux, disc.uy][k]), [a, e + 1]];
  });
  const within = F.mul(whole(radius), whole(radius));
  let first = INF;
  for (const [end, isFirst] of [
    [sector.first, true],
    [sector.last, false],
  ]) {
    const [fx, fy] = end.map(whole),
      side = paths[0].map((x, k) => F.add(F.mul(fy, x), F.neg(F.mul(fx, paths[1][k]))));
    for (const time of closings(isFirst ? side : side.map(F.neg))) {
      const [[x], [y], [overlap, ...rest]] = [...paths, gap].map((powers) => powersFrom(time, powers));
      const isAhead = sum(F.mul(fx, x), F.mul(fy, y))[0] > 0n,
        isBefore = sum(F.mul(x, x), F.mul(y, y), F.neg(within))[0] < 0n;
      if (!(overlap[0] <= 0n && isAhead && isBefore)) continue;
      for (const wait of closings([NOTHING, ...rest]))
        if (inSector(time + wait)) {
          first = Math.min(first, time + wait);
          break;
        }
    }
  }
  return first;
}
// A polynomial in time as one in the time from an instant on.
function powersFrom(time, powers) {
  const found = [...powers],
    t = frac(time);
  for (let lowest = 0; lowest < found.length; lowest++)
    for (let k = found.length - 2; k >= lowest; k--) found[k] = F.add(found[k], F.mul(t, found[k + 1]));
  return found;
}
function isInSectorAt(time, disc, { sector, centre }, gravity) {
  if (sector === null) return true;
  const [[px, movedX], [py, movedY]] = [disc.x, disc.y].map((x, k) =>
    fallen(fromPair(x, centre[k]), [disc.ux, disc.uy][k], gravity[k], time),
  );
  return isIn(sector, px, py, movedX, movedY);
}
function fallen(x, u, g, time) {
  const straight = time * u[0],
    down = 0.5 * g * time * time,
    [high, low] = twoSum(x[0], straight + down);
  return [twoSum(high, low + x[1]), abs(straight) + abs(down)];
}
function faceFalling(disc, face, gravity, leaving) {
  const [ex, ey] = face.along,
    pull = across(ex, ey, [gravity[0], 0], [gravity[1], 0]);
  if (leaving !== null) {
    if (!(pull[0] < 0)) return INF;
    const wait = returnTime(pairProduct([leaving, 0], face.length), pull);
    return footIsOn(disc, face, wait, gravity) ? wait : INF;
  }
  const gap = faceGap(disc, face),
    speed = across(ex, ey, disc.ux, disc.uy);
  if (gap[0] <= 0) {
    if (isBeforeFace(disc, face)) return descentTime(gap, speed, pull);
    if (!(speed[0] > 0) || !(pull[0] < 0)) return INF;
    if (!(discriminantFromGap(speed, [2 * gap[0], 2 * gap[1]], pull)[0] > 0)) return INF;
  }
  const wait = descentTime(gap, speed, pull);
  return wait < INF && footIsOn(disc, face, wait, gravity) ? wait : INF;
}
export function footIsOn(disc, { a, b, along: [[ex], [ey]] }, time, [gx, gy]) {
  const movedX = time * (disc.ux[0] + 0.5 * gx * time),
    movedY = time * (disc.uy[0] + 0.5 * gy * time),
    along = (end) => ex * (fromPoint(disc.x, end[0])[0] + movedX) + ey * (fromPoint(disc.y, end[1])[0] + movedY);
  return along(a) >= 0 && 0 >= along(b);
}
// When a falling disc meets a wall, and which feature of it; it has left the last one at `leaving` along the normal.
export function firstFeatureFalling(disc, features, gravity, last, leaving) {
  let least = { time: INF, feature: null, glides: false };
  for (const feature of features) {
    const when = { face: faceFalling, vertex: vertexFalling, arc: arcFalling }[feature.kind],
      time = when(disc, feature, gravity, feature === last ? leaving : null);
    if (time < least.time) least = { time, feature, glides: false };
  }
  return least;
}

// --- roots of polynomials, exactly ---
const at = (p, t, scale) => {
  let v = p[p.length - 1],
    shift = 0n;
  for (let k = p.length - 2; k >= 0; k--) {
    shift += BigInt(scale);
    v = v * t + (p[k] << shift);
  }
  return v;
};
const changes = (values) => {
  const s = values.filter((v) => v !== 0n).map((v) => v > 0n);
  let n = 0;
  for (let k = 1; k < s.length; k++) n += s[k] !== s[k - 1];
  return n;
};
const negativeRemainder = (a, b) => {
  let rest = [...a];
  const lead = b[b.length - 1],
    size = lead < 0n ? -lead : lead;
  while (rest.length >= b.length) {
    let top = rest[rest.length - 1];
    const shift = rest.length - b.length;
    rest = rest.map((c) => size * c);
    if (lead < 0n) top = -top;
    b.forEach((c, k) => {
      rest[shift + k] -= top * c;
    });
    while (rest.length && rest[rest.length - 1] === 0n) rest.pop();
  }
  const common = rest.length ? rest.reduce(gcd) : 1n,
    most = common < 0n ? -common : common;
  return rest.map((c) => -c / most);
};
// The instants after now at which a polynomial, which is not 0 now, turns negative.
function* fallsBelowZero(polynomial) {
  const p = [...polynomial];
  while (p[p.length - 1] === 0n) p.pop();
  const chain = [p, p.map((c, k) => BigInt(k) * c).slice(1)];
  while (chain[chain.length - 1].length > 1) {
    const rest = negativeRemainder(chain[chain.length - 2], chain[chain.length - 1]);
    if (!rest.length) break;
    chain.push(rest);
  }
  const sturm = chain.filter((q) => q.length),
    count = (t, scale) => changes(sturm.map((q) => at(q, t, scale))),
    atInfinity = changes(sturm.map((q) => q[q.length - 1]));
  let before = changes(sturm.map((q) => q[0])),
    low = 0n,
    high = 1n,
    scale = 0;
  while (before !== atInfinity) {
    while (count(high, scale) === before || at(p, high, scale) === 0n) high *= 2n;
    let now;
    while (before - (now = count(high, scale)) > 1) {
      [low, high, scale] = [2n * low, 2n * high, scale + 1];
      let middle = (low + high) / 2n;
      while (at(p, middle, scale) === 0n)
        [low, high, middle, scale] = [2n * low, 2n * high, 2n * middle + 1n, scale + 1];
      if (count(middle, scale) === before) low = middle;
      else high = middle;
    }
    if (at(p, low, scale) > 0n && 0n > at(p, high, scale)) yield bisected(p, low, high, scale);
    [low, before, high] = [high, now, 2n * high];
  }
}
function bisected(p, low, high, scale) {
  while ((high - low) << 55n > high) {
    [low, high, scale] = [2n * low, 2n * high, scale + 1];
    const middle = (low + high) / 2n;
    if (at(p, middle, scale) < 0n) high = middle;
    else low = middle;
  }
  return ldexp(Number(low + high), -(scale + 1)); // a BigInt becomes the nearest float
}
