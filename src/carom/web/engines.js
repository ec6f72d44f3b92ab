// Starts engines in the page, and runs scenes on them. Each engine is a packed block of text, which is unpacked when a
// user chooses the engine. A block contains the adapter's engine.mjs and the engine's package (see
// carom/web/engine_script.py). The adapter passes its World class to this module.
import { isFixed, advanced, bare } from "./scene.js";

const INSTALLED = JSON.parse(globalThis.caromText(document.getElementById("engines")));
export const installed = INSTALLED;
const START_WITHIN_MS = 20000;

globalThis.caromEngines = {};
const starting = {};
export const load = (name) => (starting[name] ??= start(name));
async function start(name) {
  const text = globalThis.caromText(document.querySelector(`script[data-engine="${name}"]`));
  return new Promise((done, fail) => {
    globalThis.caromEngines[name] = { done, fail };
    const script = document.createElement("script");
    script.textContent = text; // the page's policy allows the hash of this text
    document.head.append(script);
    setTimeout(() => fail(new Error(`${name} did not start`)), START_WITHIN_MS);
  });
}

// Runs a scene on an engine. If the contact of two bodies changes a velocity in several successive steps, the changes
// count as one impact.
export function drive(World, settings, scene, phase) {
  const dt = 1 / scene.frame_rate_hz,
    early = phase * dt;
  const start = bare(early ? advanced(scene, early) : scene);
  const world = new World(structuredClone(start), { ...settings, dt_s: dt });
  try {
    return stepped(world, scene, start, dt, early);
  } finally {
    world.free?.();
  }
}
// Largest relative change of a velocity that counts as rounding. Some engines have 32-bit floats.
const UNCHANGED = 1e-5;
function stepped(world, scene, start, dt, early) {
  world.observe(); // some engines record contacts only after the first observation
  const pullOf = (i) => (i < 0 || isFixed(scene.discs[i]) ? [0, 0] : scene.gravity_m_s2);
  const impacts = [],
    tracks = scene.discs.map((d) => [[0], [d.position_m[0]], [d.position_m[1]]]);
  const steps = Math.ceil(start.duration_s / dt - 1e-9);
  let before = {
      time_s: early,
      position_m: start.discs.map((d) => d.position_m),
      velocity_m_s: start.discs.map((d) => d.velocity_m_s),
    },
    acting = new Map(),
    warning = "",
    spent = 0;
  for (let k = 1; k <= steps; k++) {
    const clock = performance.now();
    world.step();
    spent += performance.now() - clock;
    const now = { ...structuredClone(world.observe()), time_s: early + k * dt },
      still = new Map();
    warning ||= now.warning ?? "";
    const changed = now.velocity_m_s.map((now_v, i) => {
      const was = before.velocity_m_s[i],
        pull = pullOf(i);
      const by = now_v.map((v, axis) => v - was[axis] - pull[axis] * dt);
      return Math.hypot(...by) > UNCHANGED * (1 + Math.hypot(...was));
    });
    for (const c of now.contacts) {
      const key = `${c.first} ${c.second}`,
        bodies = [c.first, c.second];
      if (still.has(key) || c.impulse_n_s === 0 || !bodies.some((i) => i >= 0 && changed[i])) continue;
      const one = acting.get(key) ?? {
        first: c.first,
        second: c.second,
        time_s: Math.min(now.time_s, early + c.time_s),
        normal: c.normal,
        began: before,
        before: bodies.map((i) => (i < 0 ? [0, 0] : before.velocity_m_s[i])),
        at: bodies.filter((i) => i >= 0).map((i) => now.position_m[i]),
        alone: true,
      };
      if (!acting.has(key)) impacts.push(one);
      one.ended = now;
      one.after = bodies.map((i) => (i < 0 ? [0, 0] : now.velocity_m_s[i]));
      still.set(key, one);
    }
    const shared = (i, one) =>
      i >= 0 &&
      !isFixed(scene.discs[i]) &&
      [...still.values()].some((r) => r !== one && (r.first === i || r.second === i));
    for (const one of still.values()) if (shared(one.first, one) || shared(one.second, one)) one.alone = false;
    now.position_m.forEach(([x, y], i) => {
      tracks[i][0].push(now.time_s);
      tracks[i][1].push(x);
      tracks[i][2].push(y);
    });
    before = now;
    acting = still;
  }
  for (const one of impacts) if (one.alone) one.effective_s = effectiveTime(one, pullOf);
  return { impacts, tracks, warning, end_s: early + steps * dt, stepped: true, step_ms: spent / Math.max(1, steps) };
}
// Returns the time at which the free paths before and after the contact are nearest to each other, or NaN if the
// velocities did not change. carom/execution/observation/open_contact.py does the same.
function effectiveTime({ first, second, began, ended }, pullOf) {
  const lasted = ended.time_s - began.time_s,
    of = (rows, axis) => (second < 0 ? 0 : rows[second][axis]) - rows[first][axis];
  let along = 0,
    squared = 0;
  for (const axis of [0, 1]) {
    const u0 = of(began.velocity_m_s, axis),
      u1 = of(ended.velocity_m_s, axis),
      pull = pullOf(second)[axis] - pullOf(first)[axis],
      slope = u0 - u1 + pull * lasted,
      offset =
        of(began.position_m, axis) - (of(ended.position_m, axis) - u1 * lasted + (pull * lasted * lasted) / 2);
    along -= offset * slope;
    squared += slope * slope;
  }
  return began.time_s + along / squared;
}
