// When a falling disc meets a half-plane or a fixed disc: carom/physics/wall_time_falling.py and pair_time_falling.py.
import { INF, ldexp, pairProduct, sqrt, twoSum } from "./arithmetic.js";
import { discriminantFromGap, exactRoot, quotient } from "./meeting.js";

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

const frac = (x) => {
  let e = 0;
  while (x !== Math.floor(x)) {
    x *= 2;
    e++;
  }
  return [BigInt(x), e];
}; // n / 2^e
const F = {
  add: ([a, e], [b, f]) => (e >= f ? [a + (b << BigInt(e - f)), e] : [(a << BigInt(f - e)) + b, f]),
  mul: ([a, e], [b, f]) => [a * b, e + f],
  neg: ([a, e]) => [-a, e],
};
const sum = (...terms) => terms.reduce(F.add);
export function encounterTime(disc, fixed, gravity, leaving = null) {
  const [x, y, ux, uy, radius, fx, fy, fr, ax, ay] = [...disc, ...fixed, ...gravity].map(frac),
    two = [2n, 0];
  const px = F.add(x, F.neg(fx)),
    py = F.add(y, F.neg(fy)),
    reach = F.add(radius, fr);
  let gap = sum(F.mul(px, px), F.mul(py, py), F.neg(F.mul(reach, reach)));
  let opening = F.mul(two, sum(F.mul(px, ux), F.mul(py, uy)));
  if (leaving !== null) {
    gap = [0n, 0];
    opening = F.mul(two, F.mul(reach, frac(leaving)));
  }
  if (gap[0] <= 0n) {
    if (opening[0] < 0n) return 0;
    gap = [0n, 0];
  }
  const [q, qe] = sum(F.mul(ax, ax), F.mul(ay, ay));
  const powers = [
    gap,
    opening,
    sum(F.mul(ux, ux), F.mul(uy, uy), F.mul(px, ax), F.mul(py, ay)),
    sum(F.mul(ux, ax), F.mul(uy, ay)),
    [q, qe + 2],
  ];
  while (powers.length && powers[0][0] === 0n) powers.shift();
  if (!powers.length) return INF;
  if (powers[0][0] < 0n) return 0;
  const most = Math.max(...powers.map(([, e]) => e));
  return firstFallBelowZero(powers.map(([a, e]) => a << BigInt(most - e)));
}
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
const gcd = (a, b) => {
  a = a < 0n ? -a : a;
  b = b < 0n ? -b : b;
  while (b) [a, b] = [b, a % b];
  return a;
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
    whole = common < 0n ? -common : common;
  return rest.map((c) => -c / whole);
};
export function firstFallBelowZero(polynomial) {
  const p = [...polynomial];
  while (p[p.length - 1] === 0n) p.pop();
  const chain = [p, p.map((c, k) => BigInt(k) * c).slice(1)];
  while (chain[chain.length - 1].length > 1) {
    const rest = negativeRemainder(chain[chain.length - 2], chain[chain.length - 1]);
    if (!rest.length) break;
    chain.push(rest);
  }
  const sturm = chain.filter((q) => q.length),
    count = (t, scale) => changes(sturm.map((q) => at(q, t, scale)));
  const atInfinity = changes(sturm.map((q) => q[q.length - 1]));
  let before = changes(sturm.map((q) => q[0])),
    low = 0n,
    high = 1n,
    scale = 0;
  if (before === atInfinity) return INF;
  while (count(high, scale) === before || at(p, high, scale) === 0n) high *= 2n;
  for (;;) {
    const now = count(high, scale);
    if (before - now === 1 && at(p, high, scale) < 0n) break;
    if (before - now <= 1) {
      if (now === atInfinity) return INF;
      const width = high - low;
      low = high;
      before = now;
      high = high + (width > 1n ? width : 1n);
      while (at(p, high, scale) === 0n) high += 1n;
      continue;
    }
    low *= 2n;
    high *= 2n;
    scale++;
    let middle = (low + high) / 2n;
    while (at(p, middle, scale) === 0n) {
      low *= 2n;
      high *= 2n;
      middle = 2n * middle + 1n;
      scale++;
    }
    if (count(middle, scale) === before) low = middle;
    else high = middle;
  }
  while ((high - low) << 55n > high) {
    low *= 2n;
    high *= 2n;
    scale++;
    const middle = (low + high) / 2n;
    if (at(p, middle, scale) < 0n) high = middle;
    else low = middle;
  }
  return ldexp(Number(low + high), -(scale + 1)); // a BigInt becomes the nearest float
}
