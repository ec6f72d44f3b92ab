// Damping as a change of time, by exponentials in whole numbers: carom/damping.py, carom/exponentials.py and
// carom/solvers/damped.py.
import { INF, abs, nextAfter } from "./arithmetic.js";
import { frac, nearest } from "./rational.js";

const BITS = 192n,
  ONE = 1n << BITS,
  LN2 = 0xb17217f7d1cf79abc9e3b39803f2f6af40f343267298b62dn,
  LARGEST = 2 ** 1023 * (2 - 2 ** -52);
// e^x as n over 2^k, to some 180 bits; k is above 0 where x is below 130.
function power(x) {
  const [m, e] = frac(x),
    fixed = (m << BITS) >> BigInt(e);
  let twos = fixed / LN2;
  if (fixed < twos * LN2) twos--;
  const rest = fixed - twos * LN2;
  let term = ONE,
    total = ONE;
  for (let k = 1n; term; k++) {
    term = ((term * rest) >> BITS) / k;
    total += term;
  }
  return [total, BITS - twos];
}
const exp = (x) => {
  if (x < -708) return 0;
  const [n, k] = power(x);
  return nearest([n, 1n << k]);
};
const expm1 = (x) => {
  if (x < -708) return -1;
  const [n, k] = power(x);
  return nearest([n - (1n << k), 1n << k]);
};
const log1p = (x) => {
  const near = Math.log1p(x), // its last bits cancel
    [n, k] = power(-near),
    [a, e] = frac(x),
    [b, f] = frac(near),
    rest = ((((1n << BigInt(e)) + a) * n) << BITS >> BigInt(e) >> k) - ONE;
  return nearest([(b << BITS) + ((rest - ((rest * rest) >> (BITS + 1n))) << BigInt(f)), 1n << (BITS + BigInt(f))]);
};

const NO_CHANGE = 2 ** -54;
// Times from the start on, of a rate above 0.
export class Damping {
  constructor(rate) {
    this.rate = rate;
  }
  kept(t) {
    return exp(-this.rate * t);
  }
  undamped(t) {
    return abs(this.rate * t) >= NO_CHANGE ? -expm1(-this.rate * t) / this.rate : t;
  }
  damped(s) {
    const way = this.rate * s;
    if (!(abs(way) >= NO_CHANGE)) return s;
    return way >= 1 ? INF : -log1p(-way) / this.rate;
  }
  // The greatest undamped time that is no later than t.
  latest(t) {
    let found = Math.min(this.undamped(t), LARGEST),
      later;
    while ((later = nextAfter(found, 1n)) < INF && this.damped(later) <= t) found = later;
    while (this.damped(found) > t) found = nextAfter(found, -1n);
    return found;
  }
}
export const dampingOf = ({ damping_per_s: rate }) => (rate ? new Damping(rate) : null);

const allTimes = (rows, kept) => rows.map((row) => row.map((x) => x * kept));
// An impact of the undamped scene as it is with damping, at a time of the clock.
export function slowed(impact, damping, time_s) {
  const kept = 1 - damping.rate * impact.time_s,
    { before, after, spins } = impact;
  return {
    ...impact,
    time_s,
    before: allTimes(before, kept),
    after: allTimes(after, kept),
    spins: spins && spins.map((spin) => spin * kept),
  };
}
// What is left of velocities and spins at the end of a run.
export function slowedAt(end_s, damping, { positions, velocities, spins }) {
  const kept = damping.kept(end_s);
  return { positions, velocities: allTimes(velocities, kept), spins: spins && spins.map((spin) => spin * kept) };
}
