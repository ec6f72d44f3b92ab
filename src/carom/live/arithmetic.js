// Sums and products of doubles without loss, as carom/physics/double_double.py has them; frexp and ldexp.
// Every operation here and in the modules built on this is one that ECMAScript rounds correctly (+ - * / Math.sqrt), in
// Carom's order: so PIC and PIT have the bits of Carom's in every browser. No Math.hypot, pow, sin: those round as they like.
const { abs, sqrt, max, min } = Math;
const INF = Infinity;
const SPLITTER = 2 ** 27 + 1; // Dekker's: it parts 53 bits in two halves
export const split = (a) => {
  const s = SPLITTER * a,
    h = s - (s - a);
  return [h, a - h];
};
export const twoSum = (a, b) => {
  const s = a + b,
    p = s - a;
  return [s, a - (s - p) + (b - p)];
};
export const twoDiff = (a, b) => {
  const s = a - b,
    p = s - a;
  return [s, a - (s - p) - (b + p)];
};
export const twoProd = (a, b) => {
  const p = a * b,
    [ah, al] = split(a),
    [bh, bl] = split(b);
  return [p, ah * bh - p + ah * bl + al * bh + al * bl];
};
export const sumOfProducts = (factors) => {
  let high = 0,
    middle = 0,
    low = 0,
    rest;
  for (const [a, b] of factors)
    for (const term of twoProd(a, b)) {
      [high, rest] = twoSum(high, term);
      [middle, rest] = twoSum(middle, rest);
      low += rest;
    }
  [high, middle] = twoSum(high, middle);
  return twoSum(high, middle + low);
};
export const exactProducts = (p, q, sign = 1) => p.flatMap((a) => q.flatMap((b) => twoProd(sign * a, b)));
export const exactSum = (terms) => {
  let parts = [],
    high = 0,
    low = 0,
    rest;
  for (const term of terms) {
    let total = term;
    const kept = [];
    for (const part of parts) {
      [total, rest] = twoSum(total, part);
      if (rest !== 0) kept.push(rest);
    }
    if (total !== 0) kept.push(total);
    parts = kept;
  }
  for (const part of parts.reverse()) {
    [high, rest] = twoSum(high, part);
    low += rest;
  }
  return twoSum(high, low);
};
export const pairProduct = (a, b) => {
  const [p, e] = twoProd(a[0], b[0]);
  return twoSum(p, e + (a[0] * b[1] + a[1] * b[0]));
};

// math.frexp's exponent and math.ldexp, exact except for results below 2^-1022
const view = new DataView(new ArrayBuffer(8));
export const exponent = (x) => {
  if (x === 0 || !Number.isFinite(x)) return 0;
  view.setFloat64(0, x);
  const e = (view.getUint16(0) >> 4) & 2047;
  return e ? e - 1022 : exponent(x * 2 ** 64) - 64;
};
export const ldexp = (x, e) => {
  while (e > 1000) {
    x *= 2 ** 1000;
    e -= 1000;
  }
  while (e < -1000) {
    x *= 2 ** -1000;
    e += 1000;
  }
  return x * 2 ** e;
};
// The next float of one above 0, up by 1n or down by -1n.
export const nextAfter = (x, by) => {
  view.setFloat64(0, x);
  view.setBigInt64(0, view.getBigInt64(0) + by);
  return view.getFloat64(0);
};
// math.hypot of Python is right to the nearest float or very nearly; that of JavaScript need not be: this one is.
export const hypot = (x, y) => {
  if (x === 0 || y === 0) return abs(x) + abs(y);
  const [a, ar] = twoProd(x, x),
    [b, br] = twoProd(y, y),
    [s, sr] = twoSum(a, b),
    low = sr + (ar + br),
    h = sqrt(s + low);
  const [q, qr] = twoProd(h, h);
  return h + (s - q - qr + low) / (2 * h);
};
export { abs, sqrt, max, min, INF };
