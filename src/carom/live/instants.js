// Instants as pairs of floats: carom/solvers/plain/instants.py.
import { INF, twoSum } from "./arithmetic.js";

export const NEVER = [INF, 0];
export const after = (instant, wait) => {
  const [t, r] = twoSum(instant[0], wait);
  return t < INF ? twoSum(t, instant[1] + r) : NEVER;
};
export const between = (a, b) => b[0] - a[0] + (b[1] - a[1]);
export const isAfter = (a, b) => a[0] > b[0] || (a[0] === b[0] && a[1] > b[1]);
export const later = (a, b) => (isAfter(b, a) ? b : a);
