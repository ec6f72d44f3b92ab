// Computes exactly when the gap between two bodies, a polynomial in time, closes. The arithmetic uses integers, as in
// carom/core/exact_quartic.py. The core calls exactFall if neither floats nor pairs of floats are precise enough; see
// polynomial.h.
import { ldexp } from "./arithmetic.js";
import { gcd, plus, rational, times } from "./rational.js";

const ZERO = [0n, 1n];

// For each power of time (lowest first), `powers` lists pairs of numbers. The coefficient is the sum of the products of
// these pairs. Returns the instant after `begin` at which the gap closes: the first for `index` 0, the second for 1,
// and so on. Returns Infinity if there is no such instant. For a negative index, returns the sign of the gap at
// `begin`.
export function exactFall(powers, begin, isClosed, index) {
  const gap = powers.map((products) => products.map(([a, b]) => times(rational(a), rational(b))).reduce(plus, ZERO)),
    start = rational(begin);
  for (let lowest = 0; lowest < gap.length; lowest++)
    for (let k = gap.length - 2; k >= lowest; k--) gap[k] = plus(gap[k], times(start, gap[k + 1]));
  if (isClosed) gap[0] = ZERO;
  if (index < 0) return Number(gap[0][0] > 0n) - Number(gap[0][0] < 0n);
  let number = 0;
  for (const time of closings(gap)) if (number++ === index) return time;
  return Infinity;
}
// Yields the instants from 0 on at which a gap closes. If the gap is closed at 0 and becomes negative, 0 is the first
// instant.
function* closings(gap) {
  const powers = [...gap];
  while (powers.length && powers[0][0] === 0n) powers.shift();
  if (!powers.length) return;
  if (powers[0][0] < 0n && powers.length < gap.length) yield 0;
  const unit = powers.map(([, d]) => d).reduce((one, other) => (one > other ? one : other)); // all denominators are powers of two
  yield* fallsBelowZero(powers.map(([n, d]) => n * (unit / d)));
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
// Yields the instants above 0 at which a polynomial becomes negative. The polynomial is not 0 at 0.
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
