// Rational numbers without rounding: pairs of numerator and denominator in lowest terms, like Python's Fraction.
// Rational numbers can be converted to the nearest float or to the nearest pair of floats, as in
// carom/core/wall_parts.py.
import { ldexp } from "./arithmetic.js";

export const gcd = (a, b) => {
  a = a < 0n ? -a : a;
  b = b < 0n ? -b : b;
  while (b) [a, b] = [b, a % b];
  return a;
};
export const ratio = (n, d) => {
  const common = gcd(n, d) * (d < 0n ? -1n : 1n);
  return [n / common, d / common];
};
// Returns the integers n and e of a float n / 2^e.
export const frac = (x) => {
  let e = 0;
  while (x !== Math.floor(x)) {
    x *= 2;
    e++;
  }
  return [BigInt(x), e];
};
export const rational = (x) => {
  const [n, e] = frac(x);
  return [n, 1n << BigInt(e)];
};
export const plus = ([a, b], [c, d]) => ratio(a * d + c * b, b * d);
export const less = ([a, b], [c, d]) => ratio(a * d - c * b, b * d);
export const times = ([a, b], [c, d]) => ratio(a * c, b * d);
export const over = ([a, b], [c, d]) => ratio(a * d, b * c);
export const negated = ([a, b]) => [-a, b];
export const alike = ([a, b], [c, d]) => a === c && b === d;
export const cross = ([ax, ay], [bx, by]) => less(times(ax, by), times(ay, bx));
export const dot = ([ax, ay], [bx, by]) => plus(times(ax, bx), times(ay, by));

const bitLength = (n) => (n < 0n ? -n : n).toString(2).length;
// Returns the nearest float. The quotient is computed with more bits than a float has. Its last bit is set if there is
// a remainder, so that the conversion to a float rounds correctly.
export const nearest = ([n, d]) => {
  if (n === 0n) return 0;
  const size = n < 0n ? -n : n,
    shift = 66 - (bitLength(size) - bitLength(d)),
    [top, bottom] = shift > 0 ? [size << BigInt(shift), d] : [size, d << BigInt(-shift)];
  const found = ldexp(Number(2n * (top / bottom) + (top % bottom ? 1n : 0n)), -shift - 1);
  return n < 0n ? -found : found;
};
export const pairOf = (number) => {
  const high = nearest(number);
  return [high, nearest(less(number, rational(high)))];
};
export const power4 = (shift) => (shift >= 0 ? [1n << BigInt(2 * shift), 1n] : [1n, 1n << BigInt(-2 * shift)]);
export const halfBits = ([n, d]) => Math.floor((bitLength(n) - bitLength(d)) / 2);
const wholeRoot = (n) => {
  let root = 1n << BigInt(Math.ceil(bitLength(n) / 2));
  for (;;) {
    const next = (root + n / root) >> 1n;
    if (next >= root) return root;
    root = next;
  }
};
const ROOT_BITS = 160;
export const rootOf = (square) => {
  if (square[0] === 0n) return [0, 0];
  const shift = ROOT_BITS - halfBits(square),
    [n, d] = times(square, power4(shift)),
    two = shift >= 0 ? [1n, 1n << BigInt(shift)] : [1n << BigInt(-shift), 1n];
  return pairOf(times([wholeRoot(n / d), 1n], two));
};
// Returns part / sqrt(square).
export const nearestRoot = (part, square) => {
  const root = rootOf(over(times(part, part), square))[0];
  return part[0] < 0n ? -root : root;
};
