// Exact difference of floats, and frexp and ldexp as in Python. ECMAScript prescribes how all operations in this file
// are rounded, and their order is that of carom/core. So the numbers for the core are bit-identical in every browser.
export const twoDiff = (a, b) => {
  const s = a - b,
    p = s - a;
  return [s, a - (s - p) - (b + p)];
};
// Return the exponent that Python's math.frexp returns, and the result of math.ldexp. Results are exact, except below
// 2^-1022.
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

export const num = (value, other) => (value === undefined ? other : value === "inf" ? Infinity : value);
