// PIC and PIT without gravity: carom/solvers/plain/run.py and carom/solvers/pit.
import { INF, max, min } from "./arithmetic.js";
import { Bodies, num, wallBody } from "./bodies.js";

// carom.solvers.plain.run: every two bodies are solved for, and the earliest impact is carried out.
const EPOCH_IMPACTS = 32;
export const standstillImpacts = (bodies) => min(100 * bodies ** 2, 10_000_000 + Math.floor(bodies ** 2 / 2));
export function solvePic(scene, maxImpacts = INF) {
  const b = new Bodies(scene),
    n = b.n,
    K = b.walls.length,
    width = K + n,
    end = scene.duration_s;
  const times = new Float64Array(n * width).fill(INF),
    impacts = [];
  let now = 0,
    reported = 0,
    atInstant = 0,
    outcome = "completed";
  const predict = (disc, skip) => {
    for (let k = 0; k < K; k++) times[disc * width + K + wallBody(k)] = b.wallImpactTime(disc, k);
    for (let o = 0; o < n; o++)
      if (!skip.includes(o)) {
        const i = min(disc, o),
          j = max(disc, o);
        times[i * width + K + j] = b.pairImpactTime(i, j);
      }
  };
  for (let i = 0; i < n; i++)
    predict(
      i,
      Array.from({ length: i + 1 }, (_, k) => k),
    );
  for (;;) {
    let at = 0;
    for (let k = 1; k < times.length; k++) if (times[k] < times[at]) at = k;
    const time = times[at],
      first = Math.floor(at / width),
      second = (at % width) - K;
    if (atInstant > standstillImpacts(n + K)) {
      outcome = "standstill";
      break;
    }
    if (time === INF || max(reported, b.sinceStart(time)) > end) break;
    if (impacts.length >= maxImpacts) {
      outcome = "max_impacts";
      break;
    }
    if (time > now) {
      now = time;
      atInstant = 0;
    }
    reported = max(reported, b.sinceStart(now));
    atInstant++;
    let moved = (second >= 0 ? [first, second] : [first]).filter((d) => b.inverseMass[d] > 0);
    impacts.push({ ...b.collide(first, second, now), time_s: reported });
    if (impacts.length % (EPOCH_IMPACTS * n) === 0) {
      b.beginEpoch(now);
      now = 0;
      moved = Array.from({ length: n }, (_, k) => k);
    }
    moved.forEach((disc, done) => predict(disc, moved.slice(0, done + 1)));
  }
  const until = outcome === "completed" ? end : reported;
  return {
    impacts,
    outcome,
    end_s: until,
    positions: b.positionsAt(b.sinceEpoch(until)),
    velocities: b.velocities(),
    spins: b.turns ? [...b.spin] : null,
  };
}

// Looks once a frame: frame k at (k + phase) / rate. Carom's PIT has phase 0.
export function framesBefore(duration, dt) {
  // carom.scene.steps_to_cover, in whole numbers
  const ratio = (x) => {
    let e = 0;
    while (x !== Math.floor(x)) {
      x *= 2;
      e++;
    }
    return [BigInt(x), 1n << BigInt(e)];
  };
  const [a, bb] = ratio(duration),
    [c, d] = ratio(dt),
    whole = a * d,
    part = bb * c,
    nearest = (2n * whole + part) / (2n * part);
  let off = whole - nearest * part;
  if (off < 0n) off = -off;
  return Number(nearest > 0n && off * (1n << 52n) <= whole ? nearest : (whole + part - 1n) / part);
}
export function solvePit(scene, rate = num(scene.frame_rate_hz, 60), { phase = 0, bodies = new Bodies(scene) } = {}) {
  const b = bodies,
    n = b.n,
    impacts = [],
    frames = phase ? Math.ceil(scene.duration_s * rate - phase) : framesBefore(scene.duration_s, 1 / rate);
  for (let frame = 0; frame < frames; frame++) {
    const t = phase ? (frame + phase) / rate : frame / rate;
    if (frame > 0 || phase) for (let i = 0; i < n; i++) b.moveTo(i, t);
    for (let i = 0; i < n; i++)
      for (let j = i + 1; j < n; j++)
        if (b.pairApproachesAndOverlaps(i, j) && !b.areParting(i, j)) {
          impacts.push(b.collidePair(i, j));
          b.lastPartner[i] = j;
          b.lastPartner[j] = i;
        }
    for (let i = 0; i < n; i++)
      for (let k = 0; k < b.walls.length; k++)
        if (b.wallApproachesAndOverlaps(i, k) && !b.areParting(i, wallBody(k))) {
          impacts.push(b.collideWall(i, k));
          b.lastPartner[i] = wallBody(k);
        }
  }
  return {
    impacts,
    outcome: "completed",
    end_s: scene.duration_s,
    frames,
    positions: b.positionsAt(scene.duration_s),
    velocities: b.velocities(),
    spins: b.turns ? [...b.spin] : null,
  };
}
