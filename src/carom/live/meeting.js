// When two discs, or a disc and a half-plane, meet: carom/physics/pair_time.py and wall_time.py, line by line.
import {
  INF,
  abs,
  exactProducts,
  exactSum,
  exponent,
  ldexp,
  max,
  pairProduct,
  split,
  sqrt,
  sumOfProducts,
  twoDiff,
  twoProd,
  twoSum,
} from "./arithmetic.js";

// The bounds of errors, and what is negligible compared with them, are those of the Python modules, which say why.
export const ERROR = 2 ** -50;
export const NEGLIGIBLE = 2 ** -900;
const GRID = 2 ** 28;
const approach = (dx, dy, ux, uy) => {
  const x = dx * ux,
    y = dy * uy;
  return [x + y, ERROR * (abs(x) + abs(y)) + NEGLIGIBLE];
};
const discriminant = (dx, dy, ux, uy, reach) => {
  const ax = dx * uy,
    ay = dy * ux,
    cross = ax - ay,
    largest = reach * reach * (ux * ux + uy * uy),
    across = abs(ax) + abs(ay);
  return [largest - cross * cross, 2 * ERROR * ((abs(cross) + ERROR * across) * across + largest) + NEGLIGIBLE];
};
export function pairTime(x1, y1, vx1, vy1, r1, x2, y2, vx2, vy2, r2) {
  const seen = () => [twoDiff(x2, x1), twoDiff(y2, y1), twoDiff(vx2, vx1), twoDiff(vy2, vy1), twoSum(r1, r2)];
  return soonest(x2 - x1, y2 - y1, vx2 - vx1, vy2 - vy1, r1 + r2, seen);
}
// Of two circles whose place, velocity and reach are pairs.
export const meetingTime = (e) => soonest(...e.map(([high]) => high), () => e);
function soonest(dx, dy, ux, uy, reach, seen) {
  const [b, bError] = approach(dx, dy, ux, uy);
  if (b > bError) return INF;
  const [d, dError] = discriminant(dx, dy, ux, uy, reach);
  if (d < -dError) return INF;
  const e = seen(),
    c = dx * dx + dy * dy - reach * reach;
  if (b < 0 && c > 0 && d > 0) {
    const root = refined(c / (sqrt(d) - b), e);
    if (root !== null) return root;
  }
  return exactPairTime(e);
}
const flown = (late, early, p, v) => {
  const [fast, slow] = split(v[0]),
    [head, error] = twoSum(p[0], late * fast);
  return [head, error + (late * slow + early * fast + (early * slow + (p[1] + late * v[1])))];
};
function refined(near, [x, y, ux, uy, [radius, radiusRest]]) {
  const [late, early] = split(near),
    grid = GRID * radius;
  const [xh, xr] = flown(late, early, x, ux),
    [yh, yr] = flown(late, early, y, uy);
  const px = xh + xr,
    py = yh + yr;
  const hx = px + grid - grid,
    hy = py + grid - grid,
    hr = radius + grid - grid;
  const lx = xh - hx + xr,
    ly = yh - hy + yr,
    lr = radius - hr + radiusRest;
  const gap = hx * hx + hy * hy - hr * hr + (2 * (hx * lx + hy * ly - hr * lr) + (lx * lx + ly * ly - lr * lr));
  const closing = -(px * ux[0] + py * uy[0]);
  if (closing === 0) return null;
  const inverse = 1 / closing,
    step = gap * inverse,
    bend = (ux[0] * ux[0] + uy[0] * uy[0]) * step * inverse;
  const speed = abs(ux[0]) + abs(uy[0]),
    extent = abs(x[0]) + abs(y[0]) + near * speed;
  const certain =
    closing >= 2 ** -10 * (radius * speed) &&
    extent <= 2 ** 34 * radius &&
    abs(bend) <= 2 ** -12 &&
    abs(step) <= 2 ** -22 * near &&
    2 ** -17 * (radius * (2 * radius + extent)) <= closing * near &&
    radius >= 2 ** -440 &&
    speed >= 2 ** -440;
  return certain ? near + 0.5 * step * (1 + bend * (0.25 + 0.125 * bend)) : null;
}
const scaled = (p, e) => [ldexp(p[0], e), ldexp(p[1], e)];
export const square = (p, sign = 1) => [
  [p[0], sign * p[0]],
  [2 * p[0], sign * p[1]],
  [p[1], sign * p[1]],
];
export const products = (p, q) => [
  [p[0], q[0]],
  [p[0], q[1]],
  [p[1], q[0]],
  [p[1], q[1]],
];
const DOUBTFUL_SUM = 2 ** -140;
export const DOUBTFUL_DISCRIMINANT = 2 ** -90;
// By how much the square of a distance is beyond that of the reach.
export function excess(x, y, reach) {
  const c = sumOfProducts([...square(x), ...square(y), ...square(reach, -1)]);
  if (!(abs(c[0]) <= DOUBTFUL_SUM * (reach[0] * reach[0]))) return c;
  return exactSum([...exactProducts(x, x), ...exactProducts(y, y), ...exactProducts(reach, reach, -1)]);
}
export function innerProduct(x, y, ux, uy) {
  const b = sumOfProducts([...products(x, ux), ...products(y, uy)]);
  if (!(abs(b[0]) <= DOUBTFUL_SUM * (abs(x[0] * ux[0]) + abs(y[0] * uy[0])))) return b;
  return exactSum([...exactProducts(x, ux), ...exactProducts(y, uy)]);
}
export function exactPairTime(e) {
  let [x, y, ux, uy, reach] = e;
  const fastest = max(abs(ux[0]), abs(uy[0]));
  if (fastest === 0) return INF;
  const length = exponent(max(abs(x[0]), abs(y[0]), reach[0])),
    pace = exponent(fastest);
  [x, y, reach] = [x, y, reach].map((p) => scaled(p, -length));
  [ux, uy] = [ux, uy].map((p) => scaled(p, -pace));
  const b = innerProduct(x, y, ux, uy);
  if (!(b[0] < 0) && !(b[0] === 0 && x[0] * e[2][0] + y[0] * e[3][0] < 0)) return INF;
  const c = excess(x, y, reach);
  if (c[0] <= 0) return 0;
  const a = sumOfProducts([...square(ux), ...square(uy)]),
    largest = a[0] * (reach[0] * reach[0]),
    b2 = b[0] * b[0];
  let d = b2 < largest ? discriminantFromGap(b, c, a) : discriminantFromMiss(x, y, ux, uy, reach, a);
  if (abs(d[0]) <= DOUBTFUL_DISCRIMINANT * (b2 < largest ? b2 : largest)) d = exactDiscriminant(x, y, ux, uy, reach);
  if (!(d[0] > 0)) return INF;
  const root = exactRoot(b, c, d, sqrt(d[0]));
  return exponent(root) + length - pace > 1024 ? INF : ldexp(root, length - pace);
}
export function discriminantFromMiss(x, y, ux, uy, reach, a) {
  const passed = sumOfProducts([...products(x, uy), ...products([-y[0], -y[1]], ux)]),
    [sq, rest] = pairProduct(passed, passed),
    [lg, lgRest] = pairProduct(a, pairProduct(reach, reach)),
    [high, low] = twoDiff(lg, sq);
  return twoSum(high, low + (lgRest - rest));
}
export function exactDiscriminant(x, y, ux, uy, reach) {
  const a = [...exactProducts(ux, ux), ...exactProducts(uy, uy)],
    passed = [...exactProducts(x, uy), ...exactProducts(y, ux, -1)];
  return exactSum([...exactProducts(a, exactProducts(reach, reach)), ...exactProducts(passed, passed, -1)]);
}
export function discriminantFromGap(b, c, a) {
  const [sq, rest] = twoProd(b[0], b[0]),
    [pr, prRest] = twoProd(a[0], c[0]),
    [high, low] = twoDiff(sq, pr);
  return twoSum(high, low + (rest - prRest + (2 * b[0] * b[1] - (a[0] * c[1] + a[1] * c[0]))));
}
export function exactRoot(b, c, d, root) {
  const [sq, sqRest] = twoProd(root, root),
    rootRest = (d[0] - sq - sqRest + d[1]) / (2 * root);
  let [high, low] = twoSum(root, -b[0]);
  low += rootRest - b[1];
  const t = c[0] / high,
    [pr, prRest] = twoProd(t, high);
  return t + (c[0] - pr - prRest + c[1] - t * low) / high;
}

// --- carom.physics.wall_time ---
export const wallGap = (x, y, r, [qx, qy, nx, ny]) => {
  const [dx, dxr] = twoDiff(x, qx),
    [dy, dyr] = twoDiff(y, qy);
  return sumOfProducts([
    [dx, nx],
    [dxr, nx],
    [dy, ny],
    [dyr, ny],
    [-r, 1],
  ]);
};
export const wallSpeed = (vx, vy, nx, ny) =>
  sumOfProducts([
    [vx, nx],
    [vy, ny],
  ]);
export const quotient = (gap, speed) => {
  const t = -gap[0] / speed[0],
    [p, rest] = twoProd(t, speed[0]);
  return t - (gap[0] + p + rest + (gap[1] + t * speed[1])) / speed[0];
};
export function wallTime(x, y, vx, vy, r, wall) {
  const [toward, error] = approach(vx, vy, wall[2], wall[3]);
  if (toward > error) return INF;
  const speed = wallSpeed(vx, vy, wall[2], wall[3]);
  if (!(speed[0] < 0)) return INF;
  const gap = wallGap(x, y, r, wall);
  return gap[0] <= 0 ? 0 : quotient(gap, speed);
}
