// Engines in the page: each is a packed block of text, unpacked when it is chosen. It is the adapter's own engine.mjs with
// its package and what adapters share (carom/live/linked.py), and hands its class of worlds here.
import { isFixed, advanced, bare } from "./scene.js";

const INSTALLED = JSON.parse(document.getElementById("engines").textContent);
export const installed = INSTALLED;
const START_WITHIN_MS = 20000;

globalThis.caromEngines = {};
const starting = {};
export const load = (name) => (starting[name] ??= start(name));
async function start(name) {
  const text = await globalThis.caromUnpacked(document.querySelector(`script[data-engine="${name}"]`));
  return new Promise((done, fail) => {
    globalThis.caromEngines[name] = { done, fail };
    const script = document.createElement("script");
    script.textContent = text; // the page's policy has its hash
    document.head.append(script);
    setTimeout(() => fail(new Error(`${name} did not start`)), START_WITHIN_MS);
  });
}

// Steps a scene through an engine. An impact is a contact that was not there a step before and changed a velocity.
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
// A velocity that free flight explains to this part of it has not changed: engines count in 32 bits, too.
const UNCHANGED = 1e-5;
function stepped(world, scene, start, dt, early) {
  world.observe(); // as the harness does before the first step
  const impacts = [],
    tracks = scene.discs.map((d) => [[0], [d.position_m[0]], [d.position_m[1]]]);
  const steps = Math.ceil(start.duration_s / dt - 1e-9);
  let before = start.discs.map((d) => d.velocity_m_s),
    touched = new Set(),
    warning = "",
    spent = 0;
  for (let k = 1; k <= steps; k++) {
    const clock = performance.now();
    world.step();
    spent += performance.now() - clock;
    const now = structuredClone(world.observe()),
      time = early + k * dt,
      touching = new Set();
    warning ||= now.warning ?? "";
    for (const c of now.contacts) {
      const key = `${c.first} ${c.second}`,
        bodies = [c.first, c.second];
      if (touching.has(key)) continue;
      touching.add(key);
      const changed = bodies.some((i) => {
        if (i < 0) return false;
        const pull = isFixed(scene.discs[i]) ? [0, 0] : scene.gravity_m_s2,
          was = before[i];
        const by = now.velocity_m_s[i].map((v, axis) => v - was[axis] - pull[axis] * dt);
        return Math.hypot(...by) > UNCHANGED * (1 + Math.hypot(...was));
      });
      if (!changed || touched.has(key)) continue;
      impacts.push({
        time_s: Math.min(time, early + c.time_s),
        first: c.first,
        second: c.second,
        normal: c.normal,
        before: bodies.map((i) => (i < 0 ? [0, 0] : before[i])),
        after: bodies.map((i) => (i < 0 ? [0, 0] : now.velocity_m_s[i])),
        at: bodies.filter((i) => i >= 0).map((i) => now.position_m[i]),
      });
    }
    now.position_m.forEach(([x, y], i) => {
      tracks[i][0].push(time);
      tracks[i][1].push(x);
      tracks[i][2].push(y);
    });
    before = now.velocity_m_s;
    touched = touching;
  }
  return { impacts, tracks, warning, end_s: early + steps * dt, stepped: true, step_ms: spent / Math.max(1, steps) };
}
