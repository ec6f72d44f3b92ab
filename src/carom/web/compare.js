// Compares a run with the exact run, for the numbers on the page. The package carom.comparator compares more thoroughly.
import { clockOf, overlapOf } from "./drawing.js";
import { isFixed } from "./scene.js";

// Returns the time at which discs bounced: the time at which their paths turned or, if that is unknown, the reported
// time.
export const bouncedAt = (r) => (Number.isFinite(r.effective_s) ? r.effective_s : r.time_s);

// Compares two runs. Impacts of the same two bodies are matched in order.
export function compare(scene, truth, run) {
  const waiting = new Map(),
    key = (r) => `${r.first} ${r.second}`;
  for (const r of run.impacts) waiting.set(key(r), [...(waiting.get(key(r)) ?? []), r]);
  const found = [],
    missed = [];
  for (const r of truth.impacts) {
    const own = waiting.get(key(r))?.shift();
    if (own) found.push([r, own]);
    else missed.push(r);
  }
  const first = truth.impacts.indexOf(missed[0]);
  const result = {
    found,
    missed,
    invented: [...waiting.values()].flat(),
    right: first < 0 ? truth.impacts.length : first,
  };
  if (!found.length) return result;
  const [r, own] = found[0],
    k = isFixed(scene.discs[r.first]) ? 1 : 0,
    [a, b] = [r.after[k], own.after[k]];
  const fastest = Math.max(...r.before.map((v) => Math.hypot(...v)));
  return {
    ...result,
    late: bouncedAt(own) - r.time_s,
    reported: own.time_s - r.time_s,
    turned: (Math.atan2(a[0] * b[1] - a[1] * b[0], a[0] * b[0] + a[1] * b[1]) * 180) / Math.PI,
    velocity: Math.hypot(a[0] - b[0], a[1] - b[1]) / fastest,
  };
}

// Returns the fraction of phases at which PIT misses the first impact. If discs flew on freely, they would approach
// during the first half of their overlap. PIT finds the impact if a frame is in the first half of the overlap. See
// compute_pit_miss_probability in carom.execution.phases.
export function missedShare(scene, truth, dt) {
  const first = truth.impacts[0];
  return first && first.second >= 0 ? Math.max(0, 1 - clockOf(scene, overlapOf(scene, first) / 2) / dt) : null;
}
